#include <cmath>

#include "trajectory/core/grinding/wheel_path.hpp"
#include "trajectory/core/part_program/cldata_verification_walks.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kFewestPoints = 12;  // of a piece, below which nothing is said
constexpr double kFaint = 1e-3;            // of the coordinate's peak

// A lone point before is no piece: pieces begin where the workpiece last stood.
void BeginPiece(ProgramVerification& result) {
  if (result.begins.empty() || result.begins.back() + 1 != result.arguments.size()) {
    result.begins.push_back(result.arguments.size());
    return;
  }
  result.arguments.pop_back();
  result.lines.pop_back();
  for (CoordinateSeries& s : result.series) {
    s.values.pop_back();
  }
}

void SampleTurns(const std::vector<Operation>& operations, ProgramVerification& result) {
  result.series = {{"X, mm", {}, {}, {}}, {"Z, mm", {}, {}, {}}, {"A, rad", {}, {}, {}}};
  double c = 0.0;
  bool first = true;
  for (const Operation& o : operations) {
    if (!Moves(o)) {
      continue;
    }
    const WheelPlace place{
        {o.x_W_mm, o.y_W_mm, o.z_W_mm},
        {std::sin(o.b_rad), -std::sin(o.a_rad) * std::cos(o.b_rad), std::cos(o.a_rad) * std::cos(o.b_rad)}};
    const auto axes = FourAxesOf(place, first ? 0.0 : c);
    if (first || !Cuts(o) || axes[3] <= c + 1e-9) {
      BeginPiece(result);
    }
    first = false;
    c = axes[3];
    result.arguments.push_back(c);
    result.lines.push_back(o.line);
    for (std::size_t k = 0; k < 3; ++k) {
      result.series[k].values.push_back(axes[k]);
    }
  }
}

// Breaks so small beside what the coordinate does that samples do not tell them from steps of higher derivatives.
void DropFaint(ProgramVerification& result) {
  std::erase_if(result.breaks, [&](const ProgramBreak& b) {
    const CoordinateSeries& s = result.series[b.coordinate];
    return (b.order == 1 && std::abs(b.size) < kFaint * s.peak_first) ||
           (b.order == 2 && std::abs(b.size) < kFaint * s.peak_second);
  });
}

void SearchSamples(ProgramVerification& result) {
  for (CoordinateSeries& s : result.series) {
    s.first.assign(s.values.size(), 0.0);
    s.second.assign(s.values.size(), 0.0);
  }
  for (std::size_t piece = 0; piece < result.begins.size(); ++piece) {
    const std::size_t from = result.begins[piece];
    const std::size_t to =
        piece + 1 < result.begins.size() ? result.begins[piece + 1] : result.arguments.size();
    for (std::size_t k = 0; to - from > kFewestPoints && k < result.series.size(); ++k) {
      SearchPiece(result, k, from, to);
    }
  }
  DropFaint(result);
}

}  // namespace

void WalkTurn(const std::vector<Operation>& operations, ProgramVerification& result) {
  SampleTurns(operations, result);
  SearchSamples(result);
}

}  // namespace lambdajet::trajectory
