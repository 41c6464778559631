#include "calibration/core/look_system.hpp"

#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/core/elastic_response.hpp"

namespace lambdajet::calibration {
namespace {

using ElasticJet = ceres::Jet<double, 4>;  // lag, damping, deflection and its velocity at the start

// A camera without noise would make weights infinite: nothing is read better than a nanometre.
constexpr double kFinestReadingMm = 1e-6;
// One sigma of the relative difference of stiffness and of damping between x and y, each way.
constexpr double kStiffnessApart = 0.05;
constexpr double kDampingApart = 0.1;

Eigen::Matrix2d Whitening(const Eigen::Matrix2d& covariance) {
  const Eigen::Matrix2d floor = kFinestReadingMm * kFinestReadingMm * Eigen::Matrix2d::Identity();
  const Eigen::LLT<Eigen::Matrix2d> root(covariance + floor);
  return root.matrixL().solve(Eigen::Matrix2d::Identity());
}

// Lower root of a covariance that may be zero.
Eigen::Matrix2d Root(const Eigen::Matrix2d& covariance) {
  Eigen::Matrix2d root = Eigen::Matrix2d::Zero();
  root(0, 0) = std::sqrt(std::max(0.0, covariance(0, 0)));
  root(1, 0) = root(0, 0) > 0.0 ? covariance(1, 0) / root(0, 0) : 0.0;
  root(1, 1) = std::sqrt(std::max(0.0, covariance(1, 1) - root(1, 0) * root(1, 0)));
  return root;
}

// What is left of the sheet's swing, one coordinate's root mean square, when the machine has settled for as long as it does: a
// stop from the path's full acceleration, at the damping of the machine file less a sigma.
double SwingLeft(const MachineDescription& machine) {
  const double lag_s2 = std::max(kLeastLagS2, machine.value(Parameter::kElasticLagS2));
  const int c = At(Parameter::kDampingTimeS);
  const double damping_s =
      std::max(0.1 * machine.parameters[c],
               machine.parameters[c] - std::sqrt(std::max(0.0, machine.covariance(c, c))));
  const double fade = std::exp(-0.5 * machine.process.measuring_settle_time_s * damping_s / lag_s2);
  return 0.5 * lag_s2 * machine.path.acceleration_mm_per_s2 * fade;
}

// Second derivatives at the knots of the C2 cubic spline with given end slopes (Thomas algorithm).
std::vector<Eigen::Vector2d> SplineAccelerations(const std::vector<double>& h,
                                                 const std::vector<Eigen::Vector2d>& r,
                                                 const Eigen::Vector2d& first_slope,
                                                 const Eigen::Vector2d& last_slope) {
  const std::size_t n = r.size();
  std::vector<Eigen::Vector2d> m(n, Eigen::Vector2d::Zero());
  if (n < 2) {
    return m;
  }
  std::vector<double> upper(n, 0.0);
  const auto slope = [&](std::size_t i) -> Eigen::Vector2d { return (r[i + 1] - r[i]) / h[i]; };
  upper[0] = 0.5;
  m[0] = 3.0 * (slope(0) - first_slope) / h[0];
  for (std::size_t i = 1; i < n; ++i) {
    const bool last = i + 1 == n;
    const double lower = h[i - 1];
    const double diagonal = last ? 2.0 * h[i - 1] : 2.0 * (h[i - 1] + h[i]);
    const Eigen::Vector2d right =
        6.0 * (last ? Eigen::Vector2d(last_slope - slope(i - 1)) : Eigen::Vector2d(slope(i) - slope(i - 1)));
    const double pivot = diagonal - lower * upper[i - 1];
    upper[i] = last ? 0.0 : h[i] / pivot;
    m[i] = (right - lower * m[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 0;) {
    m[i] -= upper[i] * m[i + 1];
  }
  return m;
}

}  // namespace

LookSystem::LookSystem(const MachineDescription& machine, const Prior& prior, std::vector<Measurement> looks)
    : machine_(machine), prior_(prior), looks_(std::move(looks)) {
  GroupMarks();
  GroupRuns();
  rows_.resize(looks_.size());
  whitening_.resize(looks_.size(), Eigen::Matrix2d::Zero());
  deflection_mm_.resize(looks_.size(), Eigen::Vector2d::Zero());
  deflection_J_elastic_.resize(looks_.size(), Eigen::Matrix2d::Zero());
  deflection_J_run_.resize(looks_.size(), Eigen::Matrix<double, 2, 6>::Zero());
  Relinearise(ParameterVector::Zero());
}

void LookSystem::GroupMarks() {
  for (const Measurement& look : looks_) {
    mark_ids_.push_back(look.mark);
  }
  std::sort(mark_ids_.begin(), mark_ids_.end());
  mark_ids_.erase(std::unique(mark_ids_.begin(), mark_ids_.end()), mark_ids_.end());
  for (const Measurement& look : looks_) {
    const auto at = std::lower_bound(mark_ids_.begin(), mark_ids_.end(), look.mark);
    mark_of_.push_back(static_cast<std::size_t>(at - mark_ids_.begin()));
  }
}

void LookSystem::GroupRuns() {
  run_of_.assign(looks_.size(), -1);
  std::size_t previous = looks_.size();  // none yet
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    if (looks_[i].kind != LookKind::kTracking) {
      continue;
    }
    const bool follows = previous + 1 == i && SameRun(looks_[previous], looks_[i]);
    if (!follows) {
      runs_.emplace_back();
      runs_.back().first = i;
    } else {
      runs_.back().step_s.push_back(
          static_cast<double>(looks_[i].exposure_ns - looks_[previous].exposure_ns) * 1e-9);
    }
    ++runs_.back().count;
    run_of_[i] = static_cast<int>(runs_.size()) - 1;
    previous = i;
  }
}

LookUnknowns LookSystem::Start() const {
  LookUnknowns start;
  start.marks.assign(mark_count(), Eigen::Vector2d::Zero());
  start.runs.assign(run_count(), Eigen::Matrix<double, kRunSize, 1>::Zero());
  return start;
}

void LookSystem::TakeMotion(Run& run, const ParameterVector& parameters) {
  std::vector<Eigen::Vector2d> place(run.count, Eigen::Vector2d::Zero());
  Eigen::Vector2d first_slope = Eigen::Vector2d::Zero();
  Eigen::Vector2d last_slope = Eigen::Vector2d::Zero();
  const Eigen::Matrix2d R_JD =
      PlanarPose{0.0, 0.0, parameters[At(Parameter::kBaseThetaRad)]}.rotation().transpose();
  for (std::size_t k = 0; k < run.count; ++k) {
    const Measurement& look = looks_[run.first + k];
    const EffectorPlace effector = PlaceEffector(machine_, parameters, look.actuator_position_mm);
    place[k] = effector.p_DE_mm;
    const Eigen::Vector2d slope = effector.J_x_q() * look.actuator_velocity_mm_per_s;
    if (k == 0) {
      first_slope = slope;
      Eigen::Matrix2d common = StraightnessCovariance(machine_, effector);
      if (IsHole(look)) {
        const EffectorPlace pierced = PlaceEffector(machine_, parameters, look.pierce_actuator_position_mm);
        common += BacklashCovariance(machine_, pierced) + StraightnessCovariance(machine_, pierced);
      }
      run.offset_scale_mm = Root(R_JD * common * R_JD.transpose());
    }
    last_slope = slope;
  }
  run.acceleration_mm_per_s2 = SplineAccelerations(run.step_s, place, first_slope, last_slope);
  const double lag_s2 = std::max(kLeastLagS2, parameters[At(Parameter::kElasticLagS2)]);
  run.deflection_scale_mm = 2.0 * lag_s2 * machine_.path.acceleration_mm_per_s2;
  run.deflection_rate_scale_mm_per_s = run.deflection_scale_mm / std::sqrt(lag_s2);
}

void LookSystem::Relinearise(const ParameterVector& z) {
  const ParameterVector parameters = prior_.At(z);
  const Eigen::Matrix2d R_JD =
      PlanarPose{0.0, 0.0, parameters[At(Parameter::kBaseThetaRad)]}.rotation().transpose();
  const double camera = machine_.uncertainties.camera_mm;
  const double swing_mm = SwingLeft(machine_);
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    const Measurement& look = looks_[i];
    const EffectorPlace now = PlaceEffector(machine_, parameters, look.actuator_position_mm);
    Eigen::Matrix2d of_place = BacklashCovariance(machine_, now);
    if (look.kind != LookKind::kTracking) {  // what is common to the pictures of a tracking run is its offset
      of_place += StraightnessCovariance(machine_, now) + swing_mm * swing_mm * Eigen::Matrix2d::Identity();
      if (IsHole(look)) {
        const EffectorPlace pierced = PlaceEffector(machine_, parameters, look.pierce_actuator_position_mm);
        of_place += BacklashCovariance(machine_, pierced) + StraightnessCovariance(machine_, pierced);
      }
    }
    const Eigen::Matrix2d covariance =
        camera * camera * Eigen::Matrix2d::Identity() + R_JD * of_place * R_JD.transpose();
    whitening_[i] = Whitening(look.kind == LookKind::kTracking ? tracking_noise_ * covariance : covariance);
  }
  for (Run& run : runs_) {
    TakeMotion(run, parameters);
  }
}

bool LookSystem::EvaluateDeflections(const ParameterVector& parameters, const LookUnknowns& at) {
  const double lag_s2 = parameters[At(Parameter::kElasticLagS2)];
  const double damping_s = parameters[At(Parameter::kDampingTimeS)];
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    const auto& n = at.runs[r];
    for (int axis = 0; axis < 2; ++axis) {
      const double sign = axis == 0 ? 1.0 : -1.0;
      const double lag_factor = std::exp(sign * kStiffnessApart * n[6]);  // positive whatever n
      const double damping_factor = std::exp(sign * kDampingApart * n[7]);
      const ElasticJet lag(lag_s2 * lag_factor, 0);
      const ElasticJet damping(damping_s * damping_factor, 1);
      Deflection<ElasticJet> state{ElasticJet(run.deflection_scale_mm * n[2 + 2 * axis], 2),
                                   ElasticJet(run.deflection_rate_scale_mm_per_s * n[3 + 2 * axis], 3)};
      for (std::size_t k = 0; k < run.count; ++k) {
        if (k > 0) {
          const double step = run.step_s[k - 1];
          const double a0 = run.acceleration_mm_per_s2[k - 1][axis];
          const double a1 = (run.acceleration_mm_per_s2[k][axis] - a0) / step;
          state = Advance(
              state, lag, damping,
              AccelerationCubic<ElasticJet>{ElasticJet(a0), ElasticJet(a1), ElasticJet(0.0), ElasticJet(0.0)},
              step);
        }
        const auto& J = state.u_mm.v;
        if (!std::isfinite(state.u_mm.a) || !J.allFinite()) {
          return false;
        }
        const std::size_t i = run.first + k;
        deflection_mm_[i][axis] = state.u_mm.a;
        deflection_J_elastic_[i].row(axis) << J[0] * lag_factor, J[1] * damping_factor;
        deflection_J_run_[i].row(axis).setZero();
        deflection_J_run_[i](axis, 2 * axis) = J[2] * run.deflection_scale_mm;
        deflection_J_run_[i](axis, 2 * axis + 1) = J[3] * run.deflection_rate_scale_mm_per_s;
        deflection_J_run_[i](axis, 4) = J[0] * lag_s2 * lag_factor * sign * kStiffnessApart;
        deflection_J_run_[i](axis, 5) = J[1] * damping_s * damping_factor * sign * kDampingApart;
      }
    }
  }
  return true;
}

bool LookSystem::Evaluate(const LookUnknowns& at) {
  const ParameterVector parameters = prior_.At(at.z);
  if (!EvaluateDeflections(parameters, at)) {
    return false;
  }
  const Eigen::Matrix2d R_JD =
      PlanarPose{0.0, 0.0, parameters[At(Parameter::kBaseThetaRad)]}.rotation().transpose();
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    const Measurement& look = looks_[i];
    LookPrediction predicted = PredictLook(machine_, parameters, look, deflection_mm_[i]);
    if (!predicted.closed) {
      return false;
    }
    LookRow& row = rows_[i];
    row.miss_mm = predicted.p_C_mm - look.p_C_mm;
    const double mark_sigma =
        IsHole(look) ? machine_.uncertainties.jet_wander_mm : machine_.uncertainties.mark_mm;
    row.J_mark = mark_sigma * whitening_[i];
    row.residual = whitening_[i] * row.miss_mm + row.J_mark * at.marks[mark_of_[i]];
    if (run_of_[i] >= 0) {
      const std::size_t r = static_cast<std::size_t>(run_of_[i]);
      const Run& run = runs_[r];
      predicted.J.middleCols<2>(At(Parameter::kElasticLagS2)) = R_JD * deflection_J_elastic_[i];
      // Turning both rails turns the motion and the deflection with it; left out, the free turn of D's x axis would seem seen.
      const Eigen::Vector2d half_turn =
          0.5 * R_JD * Eigen::Vector2d(-deflection_mm_[i].y(), deflection_mm_[i].x());
      predicted.J.col(At(Parameter::kRail1AngleRad)) += half_turn;
      predicted.J.col(At(Parameter::kRail2AngleRad)) += half_turn;
      row.J_run.leftCols<2>() = whitening_[i] * run.offset_scale_mm;
      row.J_run.rightCols<6>() = whitening_[i] * R_JD * deflection_J_run_[i];
      row.residual +=
          row.J_run.leftCols<2>() * at.runs[r].head<2>();  // the state is in the deflection already
    }
    row.J_move << whitening_[i] * predicted.J.middleCols<2>(At(Parameter::kBaseXMm)),
        whitening_[i] * predicted.J.col(At(Parameter::kSheetThetaRad));
    row.J_z.noalias() = (whitening_[i] * predicted.J) * prior_.scale;
  }
  return true;
}

}  // namespace lambdajet::calibration
