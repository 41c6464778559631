// Joins what the two simulated modules truly did into the path of the cut front on the sheet.
//
// Model: the jet meets the sheet at p_WJ(t) = X_DW(t)^-1 p_DJ(t); the front of the cut trails it as T f' + f
// = p_WJ, starting under the jet at the instant the water comes. Both streams are interpolated to each
// other's stamps and to the switches'. Frames: W; the truth is in the plant's own D. Units: mm, s; stamps in
// ns of the common clock. Shapes: samples in any order and in any batches: they are sorted by stamp, doubles
// dropped. Threads: a recorder is its owner's. Cost: joining some 50 ns a sample; memory 40 bytes a
// millisecond and stream. Errors: stretches without truth are counted in `missing`, and cut through as a
// straight line.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lambdajet::inspection {

// X_DW.
struct SheetTruth {
  std::int64_t time_ns = 0;
  double x_mm = 0.0;
  double y_mm = 0.0;
  double theta_rad = 0.0;
};

struct JetTruth {
  std::int64_t time_ns = 0;
  double x_D_mm = 0.0;
  double y_D_mm = 0.0;
};

struct WaterSwitch {
  std::int64_t time_ns = 0;
  bool on = false;
};

struct Truth {
  std::vector<SheetTruth> sheet;
  std::vector<JetTruth> jet;
  std::vector<WaterSwitch> switches;
  double lag_time_s = 0.0;
  bool jet_on_at_start = false;  // before the first switch
};

struct CutPoint {
  double time_s = 0.0;  // from the first sample
  Eigen::Vector2d p_W_mm = Eigen::Vector2d::Zero();
};

// From water on to water off.
using Cut = std::vector<CutPoint>;

struct CutPath {
  std::vector<Cut> cuts;
  std::uint64_t samples = 0;       // of the sheet's truth
  std::uint64_t missing = 0;       // sample periods without truth while the water was on
  std::uint64_t missing_idle = 0;  // and while it was off
  double cutting_time_s = 0.0;
};

CutPath JoinTruth(Truth truth);

}  // namespace lambdajet::inspection
