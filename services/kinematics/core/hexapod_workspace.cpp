#include "kinematics/core/hexapod_workspace.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "foundation/contract/expects.hpp"

namespace lambdajet::kinematics {
namespace {

int CountOf(double from, double to, double step) {
  return std::max(1, static_cast<int>(std::ceil((to - from) / step)));
}

bool Cancelled(const HexapodWorkspaceRequest& request) { return request.cancelled && request.cancelled(); }

// One row of a slice: asks along x.
class Row {
 public:
  Row(const Hexapod& hexapod, const HexapodWorkspaceRequest& request, double y_mm, double z_mm)
      : hexapod_(hexapod), request_(request), y_mm_(y_mm), z_mm_(z_mm) {}

  HexapodInverse At(double x_mm) const {
    return SolveInAllOrientations(hexapod_, request_, {x_mm, y_mm_, z_mm_});
  }
  static bool Served(const HexapodInverse& answer) { return answer.reason == Reason::kSolved; }

  // Halves between a served and a refused place; returns the last served one and what refused next to it.
  double Border(double served_x, double refused_x, HexapodBorder& border) const {
    HexapodInverse refusal = At(refused_x);
    while (std::abs(refused_x - served_x) > request_.tolerance_mm) {
      const double middle = 0.5 * (served_x + refused_x);
      const HexapodInverse answer = At(middle);
      if (Served(answer)) {
        served_x = middle;
      } else {
        refused_x = middle;
        refusal = answer;
      }
    }
    border = {refusal.bound, refusal.strut};
    return 0.5 * (served_x + refused_x);
  }

 private:
  const Hexapod& hexapod_;
  const HexapodWorkspaceRequest& request_;
  double y_mm_, z_mm_;
};

// Appends the row's spans, returns their length.
double ScanRow(const Hexapod& hexapod, const HexapodWorkspaceRequest& request, double y_mm, double z_mm,
               std::vector<HexapodSpan>& spans) {
  const Row row(hexapod, request, y_mm, z_mm);
  const int count = CountOf(request.box.x_min_mm, request.box.x_max_mm, request.step_mm);
  const double step = (request.box.x_max_mm - request.box.x_min_mm) / count;
  double length = 0.0;
  std::optional<HexapodSpan> open;
  double before_x = request.box.x_min_mm;
  for (int i = 0; i <= count; ++i) {
    const double x = request.box.x_min_mm + i * step;
    const bool served = Row::Served(row.At(x));
    if (served && !open) {
      open = HexapodSpan{y_mm, x, x, {}, {}};
      if (i > 0) {
        open->from_x_mm = row.Border(x, before_x, open->from);
      }
    }
    if (open && (!served || i == count)) {
      open->to_x_mm = served ? x : row.Border(before_x, x, open->to);
      length += open->to_x_mm - open->from_x_mm;
      spans.push_back(*open);
      open.reset();
    }
    before_x = x;
  }
  return length;
}

}  // namespace

std::string_view FaultOf(const HexapodWorkspaceRequest& r) {
  const double sum = r.box.x_min_mm + r.box.x_max_mm + r.box.y_min_mm + r.box.y_max_mm + r.box.z_min_mm +
                     r.box.z_max_mm + r.step_mm + r.tolerance_mm;
  if (!std::isfinite(sum)) {
    return "box, step and tolerance must be finite numbers";
  }
  if (!(r.box.x_max_mm > r.box.x_min_mm && r.box.y_max_mm > r.box.y_min_mm &&
        r.box.z_max_mm >= r.box.z_min_mm)) {
    return "the box's upper ends must lie above its lower ones";
  }
  if (!(r.step_mm > 0.0 && r.tolerance_mm > 0.0)) {
    return "step and tolerance must be above 0";
  }
  if (r.R_MT.empty() || r.R_MT.size() > 64) {
    return "there must be 1 to 64 orientations";
  }
  const double samples = std::ceil((r.box.x_max_mm - r.box.x_min_mm) / r.step_mm) *
                         std::ceil((r.box.y_max_mm - r.box.y_min_mm) / r.step_mm) *
                         std::max(1.0, std::ceil((r.box.z_max_mm - r.box.z_min_mm) / r.step_mm)) *
                         static_cast<double>(r.R_MT.size());
  if (!(samples <= kMostWorkspaceSamples)) {
    return "the step is too fine for the box: 5e7 samples are the most";
  }
  return {};
}

HexapodInverse SolveInAllOrientations(const Hexapod& hexapod, const HexapodWorkspaceRequest& request,
                                      const Eigen::Vector3d& p_MT_mm) {
  HexapodInverse answer;
  for (const Eigen::Matrix3d& R_MT : request.R_MT) {
    answer = SolveInverseWithMargin(hexapod, PlatformFromTool(hexapod, {p_MT_mm, R_MT}));
    if (answer.reason != Reason::kSolved) {
      return answer;
    }
  }
  return answer;
}

HexapodSlice CutSlice(const Hexapod& hexapod, const HexapodWorkspaceRequest& request, double z_mm) {
  Expects(FaultOf(request).empty(), "CutSlice: a request without fault");
  HexapodSlice slice;
  slice.z_mm = z_mm;
  const int rows = CountOf(request.box.y_min_mm, request.box.y_max_mm, request.step_mm);
  const double step = (request.box.y_max_mm - request.box.y_min_mm) / rows;
  for (int i = 0; i <= rows && !Cancelled(request); ++i) {
    const double length = ScanRow(hexapod, request, request.box.y_min_mm + i * step, z_mm, slice.spans);
    slice.area_mm2 += (i == 0 || i == rows ? 0.5 : 1.0) * step * length;
  }
  return slice;
}

namespace {

// What stops a side that lies on the row y from moving on to the next row, looked for along its length.
HexapodBorder RowBorder(const Hexapod& hexapod, const HexapodWorkspaceRequest& request, const Rectangle& r,
                        double y_mm, double z_mm) {
  constexpr int kSamples = 200;
  if (y_mm < request.box.y_min_mm || y_mm > request.box.y_max_mm) {
    return {};
  }
  for (int i = 0; i <= kSamples; ++i) {
    const double x = r.x_min_mm + (r.x_max_mm - r.x_min_mm) * i / kSamples;
    const HexapodInverse answer = SolveInAllOrientations(hexapod, request, {x, y_mm, z_mm});
    if (answer.reason != Reason::kSolved) {
      return {answer.bound, answer.strut};
    }
  }
  return {};
}

// Spans of one row: a run in the slice's list.
struct SliceRow {
  std::size_t first = 0, last = 0;
};
std::vector<SliceRow> RowsOf(const HexapodSlice& slice) {
  std::vector<SliceRow> rows;
  for (std::size_t i = 0; i < slice.spans.size(); ++i) {
    if (i == 0 || slice.spans[i].y_mm != slice.spans[i - 1].y_mm) {
      rows.push_back({i, i});
    }
    rows.back().last = i + 1;
  }
  return rows;
}

// Of a row's spans the part of [from, to] that is longest; both indices stay where the span narrows nothing.
struct Strip {
  double from_x_mm, to_x_mm;
  std::size_t from_span, to_span;
  double width_mm() const { return to_x_mm - from_x_mm; }
};
Strip Narrowed(const HexapodSlice& slice, const SliceRow& row, const Strip& strip) {
  Strip widest = strip;
  widest.to_x_mm = widest.from_x_mm;
  for (std::size_t i = row.first; i < row.last; ++i) {
    Strip part = strip;
    if (slice.spans[i].from_x_mm > part.from_x_mm) {
      part.from_x_mm = slice.spans[i].from_x_mm;
      part.from_span = i;
    }
    if (slice.spans[i].to_x_mm < part.to_x_mm) {
      part.to_x_mm = slice.spans[i].to_x_mm;
      part.to_span = i;
    }
    widest = part.width_mm() > widest.width_mm() ? part : widest;
  }
  return widest;
}

}  // namespace

HexapodRectangle LargestRectangle(const Hexapod& hexapod, const HexapodWorkspaceRequest& request,
                                  const HexapodSlice& slice) {
  const std::vector<SliceRow> rows = RowsOf(slice);
  const int count = CountOf(request.box.y_min_mm, request.box.y_max_mm, request.step_mm);
  const double step = (request.box.y_max_mm - request.box.y_min_mm) / count;
  HexapodRectangle best;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = rows[i].first; k < rows[i].last; ++k) {
      const HexapodSpan& span = slice.spans[k];
      Strip strip{span.from_x_mm, span.to_x_mm, k, k};
      for (std::size_t j = i + 1; j < rows.size() && strip.width_mm() > 0.0; ++j) {
        const double y = slice.spans[rows[j].first].y_mm;
        if (y - slice.spans[rows[j - 1].first].y_mm > 1.5 * step) {
          break;  // a row between without spans
        }
        strip = Narrowed(slice, rows[j], strip);
        const Rectangle r{strip.from_x_mm, span.y_mm, strip.to_x_mm, y};
        if (strip.width_mm() > 0.0 && r.area_mm2() > best.rectangle.area_mm2()) {
          best = {r, {slice.spans[strip.from_span].from, slice.spans[strip.to_span].to, {}, {}}};
        }
      }
    }
  }
  if (best.rectangle.area_mm2() > 0.0) {
    const Rectangle& r = best.rectangle;
    best.binding[2] = RowBorder(hexapod, request, r, r.y_min_mm - step, slice.z_mm);
    best.binding[3] = RowBorder(hexapod, request, r, r.y_max_mm + step, slice.z_mm);
  }
  return best;
}

HexapodVoxels FillVoxels(const Hexapod& hexapod, const HexapodWorkspaceRequest& request) {
  Expects(FaultOf(request).empty(), "FillVoxels: a request without fault");
  const HexapodBox& box = request.box;
  HexapodVoxels voxels;
  voxels.step_mm = request.step_mm;
  voxels.count_x = CountOf(box.x_min_mm, box.x_max_mm, request.step_mm);
  voxels.count_y = CountOf(box.y_min_mm, box.y_max_mm, request.step_mm);
  voxels.count_z = CountOf(box.z_min_mm, box.z_max_mm, request.step_mm);
  const std::size_t row = static_cast<std::size_t>(voxels.count_x);
  voxels.reason.reserve(row * static_cast<std::size_t>(voxels.count_y) *
                        static_cast<std::size_t>(voxels.count_z));
  long served = 0;
  for (int iz = 0; iz < voxels.count_z; ++iz) {
    for (int iy = 0; iy < voxels.count_y && !Cancelled(request); ++iy) {
      for (int ix = 0; ix < voxels.count_x; ++ix) {
        const Eigen::Vector3d centre = Eigen::Vector3d(box.x_min_mm, box.y_min_mm, box.z_min_mm) +
                                       request.step_mm * Eigen::Vector3d(ix + 0.5, iy + 0.5, iz + 0.5);
        const Reason reason = SolveInAllOrientations(hexapod, request, centre).reason;
        served += reason == Reason::kSolved ? 1 : 0;
        voxels.reason.push_back(static_cast<std::uint8_t>(reason));
      }
    }
  }
  voxels.volume_mm3 = static_cast<double>(served) * std::pow(request.step_mm, 3);
  return voxels;
}

}  // namespace lambdajet::kinematics
