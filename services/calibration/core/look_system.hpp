// Lines up a run of looks as one system of whitened residuals with its derivatives, for any solver.
//
// Model: unknowns, all scaled to a prior N(0, I): z, the 19 parameters (core/prior.hpp); for each mark or hole two, its
// place off the drawing's or the jet's wander, as the camera sees it; for each tracking run eight: a common offset by
// straightness of the rails, deflection and its velocity at the first picture in x and y, and by how much m/k and c/k in x
// are above, in y below their mean (levers are not quite equally stiff both ways; the parameters are the means). Residual
// of a look, C its covariance from camera, backlash and straightness (at rest) and C^-1 = K^T K:
//     r = K (p_C(z, deflection) + sigma_mark m + offset - p_C,seen)
// The deflection in a tracking run integrates core/elastic_response.hpp over the effector's motion, which is the C2 cubic
// spline through the readings' places with the measured velocities at its ends; the motion is taken at the parameters of
// the last Relinearise(), since its change with them is of second order (0.1 % of a deflection of 0.4 mm).
// Frames: deflections in D, offsets and residuals in C.
// Units: mm, s before whitening.
// Validity: looks selected by SelectUsable(), in its order.
// Threads: one system, one thread.
// Cost: Evaluate() about 2 microseconds a look, without allocation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/core/look_model.hpp"
#include "calibration/core/measurement.hpp"
#include "calibration/core/prior.hpp"

namespace lambdajet::calibration {

inline constexpr int kMarkSize = 2;
inline constexpr int kRunSize = 8;

// A look in its whitened form at the point last evaluated.
struct LookRow {
  Eigen::Vector2d miss_mm = Eigen::Vector2d::Zero();   // predicted by the parameters alone, minus seen
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();  // whitened, with mark and run taken in
  Eigen::Matrix<double, 2, kAll> J_z = Eigen::Matrix<double, 2, kAll>::Zero();
  Eigen::Matrix<double, 2, 3> J_move =
      Eigen::Matrix<double, 2, 3>::Zero();  // to base x, y and sheet theta, unscaled
  Eigen::Matrix2d J_mark = Eigen::Matrix2d::Zero();
  Eigen::Matrix<double, 2, kRunSize> J_run = Eigen::Matrix<double, 2, kRunSize>::Zero();
};

struct LookUnknowns {
  ParameterVector z = ParameterVector::Zero();
  std::vector<Eigen::Vector2d> marks;
  std::vector<Eigen::Matrix<double, kRunSize, 1>> runs;
};

class LookSystem {
 public:
  LookSystem(const MachineDescription& machine, const Prior& prior, std::vector<Measurement> looks);

  std::size_t look_count() const { return looks_.size(); }
  const Measurement& look(std::size_t i) const { return looks_[i]; }
  std::size_t mark_of(std::size_t i) const { return mark_of_[i]; }
  int run_of(std::size_t i) const { return run_of_[i]; }  // -1: not tracking
  std::size_t mark_count() const { return mark_ids_.size(); }
  std::size_t run_count() const { return runs_.size(); }
  const Prior& prior() const { return prior_; }
  const MachineDescription& machine() const { return machine_; }
  LookUnknowns Start() const;

  // Takes tracking pictures for noisier than stated: their covariance times `variance_scale`, from the next Relinearise() on.
  void SetTrackingNoise(double variance_scale) { tracking_noise_ = variance_scale; }
  // Takes the effector's motion of the tracking runs, and the looks' covariances, at these parameters.
  void Relinearise(const ParameterVector& z);
  // False where the mechanism cannot be assembled at some look; rows are then not to be used.
  bool Evaluate(const LookUnknowns& at);
  const LookRow& row(std::size_t i) const { return rows_[i]; }

 private:
  struct Run {
    std::size_t first = 0;
    std::size_t count = 0;
    std::vector<double> step_s;                           // count - 1
    std::vector<Eigen::Vector2d> acceleration_mm_per_s2;  // at each picture; linear between
    Eigen::Matrix2d offset_scale_mm = Eigen::Matrix2d::Zero();
    double deflection_scale_mm = 0.0;
    double deflection_rate_scale_mm_per_s = 0.0;
  };

  void GroupMarks();
  void GroupRuns();
  void TakeMotion(Run& run, const ParameterVector& parameters);
  bool EvaluateDeflections(const ParameterVector& parameters, const LookUnknowns& at);

  MachineDescription machine_;
  Prior prior_;
  double tracking_noise_ = 1.0;
  std::vector<Measurement> looks_;
  std::vector<int> mark_ids_;
  std::vector<std::size_t> mark_of_;
  std::vector<int> run_of_;
  std::vector<Run> runs_;
  std::vector<Eigen::Matrix2d> whitening_;
  std::vector<LookRow> rows_;
  std::vector<Eigen::Vector2d> deflection_mm_;                     // in D, of tracking looks
  std::vector<Eigen::Matrix<double, 2, 2>> deflection_J_elastic_;  // to lag and damping
  std::vector<Eigen::Matrix<double, 2, 6>> deflection_J_run_;      // to the last six of the run's
};

}  // namespace lambdajet::calibration
