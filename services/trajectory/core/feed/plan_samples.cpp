#include "trajectory/core/feed/plan_samples.hpp"

#include <algorithm>

#include "trajectory/core/idle_motion/idle_law.hpp"

namespace lambdajet::trajectory {
namespace {

IdlePoint Between(double z0, double v0, double a0, double z1, double v1, double a1, double T, double t) {
  return MakeQuintic({z0, z1, v0, v1, a0, a1, T}).At(t);
}

PlanSample JetAt(const std::vector<PlanSample>& samples, double tau_s) {
  const auto after = std::upper_bound(samples.begin(), samples.end(), tau_s,
                                      [](double t, const PlanSample& s) { return t < s.tau_s; });
  if (after == samples.begin() || after == samples.end()) {
    PlanSample end = after == samples.begin() ? samples.front() : samples.back();
    end.tau_s = tau_s;
    return end;
  }
  const PlanSample& a = *std::prev(after);
  const PlanSample& b = *after;
  const double T = b.tau_s - a.tau_s, t = tau_s - a.tau_s;
  const IdlePoint x =
      Between(a.x_W_mm, a.vx_W_mm_per_s, a.ax_W_mm_per_s2, b.x_W_mm, b.vx_W_mm_per_s, b.ax_W_mm_per_s2, T, t);
  const IdlePoint y =
      Between(a.y_W_mm, a.vy_W_mm_per_s, a.ay_W_mm_per_s2, b.y_W_mm, b.vy_W_mm_per_s, b.ay_W_mm_per_s2, T, t);
  PlanSample jet = a;
  jet.tau_s = tau_s;
  jet.x_W_mm = x.z, jet.vx_W_mm_per_s = x.first, jet.ax_W_mm_per_s2 = x.second;
  jet.y_W_mm = y.z, jet.vy_W_mm_per_s = y.first, jet.ay_W_mm_per_s2 = y.second;
  return jet;
}

}  // namespace

FullSample SampleAt(const PlannedProgram& planned, double tau_s) {
  FullSample sample;
  if (planned.samples.empty() || planned.plan.segments.empty()) {
    return sample;
  }
  sample.jet = JetAt(planned.samples, tau_s);
  const std::vector<Segment>& segments = planned.plan.segments;
  const auto after = std::upper_bound(segments.begin(), segments.end(), tau_s,
                                      [](double t, const Segment& s) { return t < s.start_s; });
  const Segment& segment = after == segments.begin() ? segments.front() : *std::prev(after);
  const double t = std::clamp(tau_s - segment.start_s, 0.0, segment.duration_s);
  sample.jet.s_mm = segment.s_mm.value(t);
  for (std::size_t a = 0; a < kActuatorCount; ++a) {
    sample.actuator_mm[a] = segment.q_mm[a].value(t) + segment.lead_mm[a].value(t);
    sample.actuator_mm_per_s[a] = segment.q_mm[a].first(t) + segment.lead_mm[a].first(t);
  }
  return sample;
}

}  // namespace lambdajet::trajectory
