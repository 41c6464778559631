#include "trajectory/core/spatial_feed/plan_spatial_program.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>

#include "kinematics/core/hexapod_singularity.hpp"
#include "trajectory/core/feed/moving_time.hpp"
#include "trajectory/core/spatial_feed/spatial_draft.hpp"

namespace lambdajet::trajectory {
namespace {

// FNV-1a over the bits of numbers.
class Hash {
 public:
  void Add(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    AddBits(bits);
  }
  void AddBits(std::uint64_t bits) {
    for (int i = 0; i < 8; ++i) {
      hash_ = (hash_ ^ (bits >> (8 * i) & 0xff)) * 0x100000001b3ULL;
    }
  }
  std::uint64_t value() const { return hash_ == 0 ? 1 : hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

void AddPose(Hash& hash, const Pose& X) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    hash.Add(X.p_mm[i]);
  }
  for (Eigen::Index i = 0; i < 9; ++i) {
    hash.Add(X.R(i));
  }
}

std::uint64_t IdOf(const std::vector<Operation>& operations, const HexapodGeometry& g, const HexapodMotion& m,
                   const SpatialOptions& options) {
  Hash hash;
  for (const Operation& o : operations) {
    hash.AddBits(static_cast<std::uint64_t>(o.kind) << 8 | static_cast<std::uint64_t>(o.plane));
    for (const double value : {o.x_W_mm, o.y_W_mm, o.z_W_mm, o.a_rad, o.b_rad, o.c_rad, o.center_x_W_mm,
                               o.center_y_W_mm, o.center_z_W_mm, o.sweep_rad, o.feed_mm_per_s, o.value}) {
      hash.Add(value);
    }
  }
  for (Eigen::Index i = 0; i < 3 * kStruts; ++i) {
    hash.Add(g.p_MA_mm(i)), hash.Add(g.p_PB_mm(i));
  }
  for (Eigen::Index j = 0; j < kStruts; ++j) {
    hash.Add(g.length_zero_mm[j]);
    const UniversalJoint& u = g.joints[static_cast<std::size_t>(j)];
    for (const double value :
         {u.a1x_mm, u.a1y_mm, u.a1z_mm, u.dx_rad, u.dz_rad, u.ex_mm, u.ez_mm, u.eps_rad, u.h_mm, u.nu_rad}) {
      hash.Add(value);
    }
  }
  AddPose(hash, g.X_PT), AddPose(hash, g.X_MP_home), AddPose(hash, m.X_MT_zero);
  for (const double value :
       {g.screw_lead_mm, m.strut_velocity_mm_per_s, m.strut_acceleration_mm_per_s2, m.strut_jerk_mm_per_s3,
        m.feed_mm_per_s, m.rapid_mm_per_s, m.path_acceleration_mm_per_s2, m.path_jerk_mm_per_s3,
        m.corner_tolerance_mm, m.corner_tolerance_rad, m.spindle_most_per_min, m.spindle_run_up_s,
        options.feed_scale, options.knot_s, static_cast<double>(options.knots_per_segment)}) {
    hash.Add(value);
  }
  return hash.value();
}

std::optional<ProgramFault> TooLong(const SpatialPath& path) {
  MovingTime time;
  for (const SpatialRun& run : path.runs) {
    for (const SpatialPiece& piece : run.pieces) {
      time.Move(piece.length_mm / piece.feed_mm_per_s, piece.line);
    }
    time.StandStill();
  }
  return time.TooLong();
}

class ProgramPlanner {
 public:
  ProgramPlanner(const SpatialModel& model, PlannedSpatialProgram& out) : model_(model), out_(out) {}

  // False where it was stopped.
  bool Plan(const SpatialPath& path, const PlanProgress& progress) {
    double whole_mm = 0.0;
    for (const SpatialRun& run : path.runs) {
      whole_mm += run.length_mm();
      for (const SpatialPiece& piece : run.pieces) {
        out_.cutting_length_mm += piece.cutting ? piece.length_mm : 0.0;
      }
    }
    for (const SpatialRun& run : path.runs) {
      if (progress && !progress(whole_mm > 0.0 ? s_mm_ / whole_mm : 0.0)) {
        return false;
      }
      Events(run);
      if (!run.pieces.empty()) {
        Append(PlanSpatialStretch(model_, run, s_mm_));
        s_mm_ += run.length_mm();
      }
      if (out_.plan.segments.empty() && out_.faults.empty() &&
          (run.gate != GateKind::kNone || &run == &path.runs.back())) {
        Append(RestAt(model_, path.start, s_mm_));
      }
      if (!out_.faults.empty()) {
        return true;
      }
      CloseGate(run);
    }
    Finish();
    return true;
  }

 private:
  void Append(SpatialStretchPlan stretch) {
    out_.faults.insert(out_.faults.end(), stretch.faults.begin(), stretch.faults.end());
    for (SpatialSegment& segment : stretch.segments) {
      segment.index = static_cast<std::uint32_t>(out_.plan.segments.size());
      segment.start_s += out_.plan.duration_s;
      out_.plan.segments.push_back(segment);
    }
    for (SpatialPlanSample& sample : stretch.samples) {
      sample.tau_s += out_.plan.duration_s;
      out_.samples.push_back(sample);
    }
    out_.slow.insert(out_.slow.end(), stretch.slow.begin(), stretch.slow.end());
    for (std::size_t i = 0; i < kFeedLimitCount; ++i) {
      binding_mm_[i] += stretch.binding_mm[i];
    }
    out_.tip_deviation_mm = std::max(out_.tip_deviation_mm, stretch.tip_deviation_mm);
    out_.turn_deviation_rad = std::max(out_.turn_deviation_rad, stretch.turn_deviation_rad);
    out_.plan.duration_s += stretch.duration_s;
  }

  void Events(const SpatialRun& run) {
    for (const SpatialEvent& e : run.events) {
      out_.plan.events.push_back({static_cast<std::uint32_t>(out_.plan.events.size()), e.action,
                                  s_mm_ + e.offset_mm, e.argument, e.line});
    }
  }

  // Two gates at one place: a rest between them.
  void CloseGate(const SpatialRun& run) {
    if (run.gate == GateKind::kNone) {
      return;
    }
    if (out_.plan.segments.back().gate_at_end != 0) {
      SpatialSegment rest = out_.plan.segments.back();
      rest.index += 1;
      rest.start_s += rest.duration_s;
      for (std::size_t j = 0; j <= kStrutCount; ++j) {
        Polynomial& p = j < kStrutCount ? rest.q_mm[j] : rest.s_mm;
        p = Polynomial{{p.value(rest.duration_s)}};
      }
      out_.plan.segments.push_back(rest);
      out_.plan.duration_s += rest.duration_s;
    }
    const auto id = static_cast<std::uint32_t>(out_.plan.gates.size() + 1);
    out_.plan.gates.push_back({id, run.gate, s_mm_, run.gate_argument, run.gate_line, {}});
    out_.plan.segments.back().gate_at_end = id;
    if (run.gate == GateKind::kDwell) {
      out_.gate_time_s += run.gate_argument;
    }
  }

  void Finish() {
    out_.plan.length_mm = s_mm_;
    for (std::size_t i = 0; i < kFeedLimitCount; ++i) {
      if (binding_mm_[i] > 0.0) {
        out_.binding.push_back({static_cast<FeedLimit>(i), binding_mm_[i]});
      }
    }
    std::sort(out_.binding.begin(), out_.binding.end(),
              [](const auto& a, const auto& b) { return a.length_mm > b.length_mm; });
    out_.singular_margin_ratio = 1e9;
    out_.shortest_mm.setConstant(1e9);
    out_.longest_mm.setConstant(-1e9);
    for (std::size_t i = 0; i < out_.samples.size(); ++i) {
      const SpatialPlanSample& sample = out_.samples[i];
      const Pose X_MP = model_.struts.PlatformAt(sample.p_W_mm, sample.q_W);
      const double margin = kinematics::AnalyseSingularity(model_.struts.hexapod(), X_MP).signed_margin;
      const StrutVector lengths = kinematics::SolveInverse(model_.struts.hexapod(), X_MP).lengths_mm;
      out_.singular_margin_ratio = std::min(out_.singular_margin_ratio, margin);
      out_.shortest_mm = out_.shortest_mm.cwiseMin(lengths);
      out_.longest_mm = out_.longest_mm.cwiseMax(lengths);
      if (i + 1 < out_.samples.size() && sample.cutting && sample.path_speed_mm_per_s > 1e-6) {
        out_.cutting_time_s += out_.samples[i + 1].tau_s - sample.tau_s;
      }
    }
  }

  const SpatialModel& model_;
  PlannedSpatialProgram& out_;
  std::array<double, kFeedLimitCount> binding_mm_{};
  double s_mm_ = 0.0;
};

}  // namespace

PlannedSpatialProgram PlanSpatialProgram(const std::vector<Operation>& operations,
                                         const std::string& machine_id, const HexapodGeometry& geometry,
                                         const HexapodMotion& motion, const SpatialOptions& options,
                                         const PlanProgress& progress) {
  const SpatialModel model(geometry, motion, options);
  PlannedSpatialProgram out;
  out.plan.id = IdOf(operations, geometry, motion, options);
  out.plan.machine_id = machine_id;
  out.plan.turn_radius_mm = model.turn_radius_mm;
  const SpatialPath path = MakeSpatialPath(operations, motion, model.turn_radius_mm, options.feed_scale);
  out.faults = path.faults;
  if (const std::optional<ProgramFault> fault = TooLong(path); fault && out.faults.empty()) {
    out.faults.push_back(*fault);
  }
  const bool finished = !out.faults.empty() || ProgramPlanner(model, out).Plan(path, progress);
  if (!out.faults.empty() || !finished) {
    out.plan.segments.clear();
  }
  return out;
}

StrutState StrutsAt(const SpatialPlan& plan, double tau_s) {
  const auto after = std::upper_bound(plan.segments.begin(), plan.segments.end(), tau_s,
                                      [](double t, const SpatialSegment& s) { return t < s.start_s; });
  const SpatialSegment& segment = after == plan.segments.begin() ? plan.segments.front() : *std::prev(after);
  const double t = std::clamp(tau_s - segment.start_s, 0.0, segment.duration_s);
  StrutState state;
  for (int j = 0; j < kStrutCount; ++j) {
    const Polynomial& p = segment.q_mm[static_cast<std::size_t>(j)];
    state.q_mm[j] = p.value(t);
    state.first[j] = p.first(t);
    state.second[j] = p.second(t);
  }
  return state;
}

}  // namespace lambdajet::trajectory
