#include "trajectory/core/spatial_feed/spatial_draft.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kFirstKnot = 4;  // sample of the plan's first knot; its spline needs those before

SpatialSample SampleOf(const SpatialPoint& point, double s_mm) {
  SpatialSample sample;
  sample << point.p_mm, point.q.w(), point.q.x(), point.q.y(), point.q.z(), s_mm;
  return sample;
}

}  // namespace

SpatialDraft::SpatialDraft(const SpatialModel& model, const SpatialRun& run, double begin_s_mm,
                           std::vector<ProgramFault>& faults)
    : model_(model),
      run_(run),
      begin_s_mm_(begin_s_mm),
      nodes_(MakeSpatialNodes(model, run, faults)),
      lead_(static_cast<std::size_t>(model.filter.reach()) + 1) {
  pace_.Reset(nodes_.size());
}

bool SpatialDraft::Move() {
  SetSpeeds();
  if (!(node_time_s_.back() <= kLongestRun_s)) {
    return false;
  }
  SampleTime();
  SmoothKnots();
  return true;
}

double SpatialDraft::SlowestOffset_mm() const {
  std::size_t slowest = 0;
  const auto lasts = [&](std::size_t k) { return node_time_s_[k + 1] - node_time_s_[k]; };
  for (std::size_t k = 0; k + 1 < node_time_s_.size(); ++k) {
    slowest = lasts(k) > lasts(slowest) ? k : slowest;
  }
  return nodes_[slowest].offset_mm;
}

double SpatialDraft::Slow(std::span<const SlowPlace> places, double widening) {
  const std::ptrdiff_t last =
      pace_.Slow(places, widening * model_.filter.half_support_s(), 0.0, node_time_s_);
  return last < 0 ? 0.0 : nodes_[static_cast<std::size_t>(last)].offset_mm;
}

const SpatialPiece& SpatialDraft::PieceAt(double offset_mm) const {
  const auto after = std::upper_bound(run_.pieces.begin(), run_.pieces.end(), offset_mm,
                                      [](double o, const SpatialPiece& p) { return o < p.begin_mm; });
  return after == run_.pieces.begin() ? run_.pieces.front() : *std::prev(after);
}

double SpatialDraft::Size(const Eigen::Vector3d& tip, const Eigen::Vector3d& turn) const {
  return std::hypot(tip.norm(), model_.turn_radius_mm * turn.norm());
}

void SpatialDraft::SetSpeeds() {
  if (free_mm_per_s_.empty()) {
    RememberSpeeds();
  } else {
    solved_ = nodes_;
    pace_.Cap(free_mm_per_s_, solved_);
    SolveSpeedProfile(solved_, model_.bounds, 0.0, 0.0);
  }
  node_time_s_.assign(1, 0.0);
  for (std::size_t k = 0; k + 1 < solved_.size(); ++k) {
    const double v = std::sqrt(solved_[k].x) + std::sqrt(solved_[k + 1].x);
    node_time_s_.push_back(node_time_s_.back() + 2.0 * (solved_[k + 1].offset_mm - solved_[k].offset_mm) / v);
  }
}

// Standstill takes its neighbour's speed, so that slowing has something to count from.
void SpatialDraft::RememberSpeeds() {
  solved_ = nodes_;
  SolveSpeedProfile(solved_, model_.bounds, 0.0, 0.0);
  for (const SpatialNode& node : solved_) {
    free_mm_per_s_.push_back(std::sqrt(node.x));
  }
  free_mm_per_s_.front() = free_mm_per_s_[1];
  free_mm_per_s_.back() = free_mm_per_s_[free_mm_per_s_.size() - 2];
}

void SpatialDraft::SampleTime() {
  const std::size_t per_segment = knots_per_segment();
  const auto count = static_cast<std::size_t>(std::ceil(node_time_s_.back() / knot_s() - 1e-9)) + 1;
  segment_count_ = (count + 2 * (lead_ - 1) + per_segment) / per_segment;
  samples_.clear();
  samples_.assign(kFirstKnot + lead_, SampleOf(PointOn(run_.pieces.front(), 0.0), begin_s_mm_));
  std::size_t cell = 0, piece = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double offset = OffsetAt(static_cast<double>(k) * knot_s(), cell);
    while (piece + 1 < run_.pieces.size() && run_.pieces[piece + 1].begin_mm <= offset) {
      ++piece;
    }
    samples_.push_back(
        SampleOf(PointOn(run_.pieces[piece], offset - run_.pieces[piece].begin_mm), begin_s_mm_ + offset));
  }
  const SpatialPiece& last = run_.pieces.back();
  const SpatialSample end = SampleOf(PointOn(last, last.length_mm), begin_s_mm_ + run_.length_mm());
  samples_.back() = end;
  samples_.resize(kFirstKnot + segment_count_ * per_segment + 5, end);
}

double SpatialDraft::OffsetAt(double t, std::size_t& cell) const {
  if (t >= node_time_s_.back()) {
    return run_.length_mm();
  }
  while (cell + 2 < node_time_s_.size() && node_time_s_[cell + 1] <= t) {
    ++cell;
  }
  const SpatialNode& a = solved_[cell];
  const SpatialNode& b = solved_[cell + 1];
  const double u = 0.5 * (b.x - a.x) / (b.offset_mm - a.offset_mm);
  const double dt = t - node_time_s_[cell];
  return std::clamp(a.offset_mm + dt * (std::sqrt(a.x) + 0.5 * u * dt), a.offset_mm, b.offset_mm);
}

void SpatialDraft::SmoothKnots() {
  const std::vector<SpatialSample> control = Smooth(model_.filter, samples_);
  knots_.clear();
  for (std::size_t n = 0; n <= segment_count_ * knots_per_segment(); ++n) {
    knots_.push_back(EvaluateKnot(control, kFirstKnot + n, knot_s()));
  }
}

}  // namespace lambdajet::trajectory
