#include "trajectory/core/feed/stretch_draft.hpp"

#include <algorithm>

namespace lambdajet::trajectory {

double StretchDraft::SegmentTime_s(std::size_t segment) const {
  const auto knots = static_cast<std::ptrdiff_t>(segment) * knots_per_segment;
  return static_cast<double>(knots + first_knot) * knot_s;
}

bool StretchDraft::FlowsOn(std::size_t i) const {
  return !elements[i].flush_after && i + 1 < elements.size() && elements[i + 1].kind == ElementKind::kIdle;
}

std::uint32_t StretchDraft::LineAtTime(double time_s) const {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (time_s < planned[i].end_time_s || i + 1 == elements.size()) {
      if (!IsRun(i)) {
        return elements[i].line;
      }
      const PlannedRun& run = planned[i].run;
      std::size_t k = 0;
      while (k + 1 < run.node_time_s.size() && run.node_time_s[k + 1] + planned[i].begin_time_s < time_s) {
        ++k;
      }
      return LineInRun(i, run.nodes[k].offset_mm);
    }
  }
  return 0;
}

std::uint32_t StretchDraft::LineAt(double s_mm) const {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (s_mm <= planned[i].end_s_mm() || i + 1 == elements.size()) {
      return IsRun(i) ? LineInRun(i, s_mm - planned[i].begin_s_mm) : elements[i].line;
    }
  }
  return 0;
}

std::uint32_t StretchDraft::LineInRun(std::size_t run, double offset_mm) const {
  const std::vector<PathPiece>& pieces = elements[run].pieces;
  const auto after = std::upper_bound(pieces.begin(), pieces.end(), offset_mm,
                                      [](double o, const PathPiece& p) { return o < p.begin_mm; });
  return after == pieces.begin() ? pieces.front().line : std::prev(after)->line;
}

}  // namespace lambdajet::trajectory
