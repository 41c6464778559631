#include "inspection/core/cut_path.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::inspection {
namespace {

template <class Sample>
void SortByTime(std::vector<Sample>& samples) {
  std::ranges::stable_sort(samples, {}, &Sample::time_ns);
  const auto same = std::ranges::unique(samples, {}, &Sample::time_ns);
  samples.erase(same.begin(), same.end());
}

double Seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

// The usual distance of stamps: the median, so that gaps do not count.
template <class Sample>
std::int64_t Period(const std::vector<Sample>& samples) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back(samples[i].time_ns - samples[i - 1].time_ns);
  }
  if (steps.empty()) {
    return 1;
  }
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  return std::max<std::int64_t>(1, steps[steps.size() / 2]);
}

// Walks forward only: one pass over each stream.
class Interpolator {
 public:
  explicit Interpolator(const Truth& truth) : truth_(truth) {}

  Eigen::Vector2d JetOnSheet(std::int64_t time_ns) {
    const auto& sheet = truth_.sheet;
    const auto& jet = truth_.jet;
    const double a = Advance(sheet, sheet_, time_ns);
    const double b = Advance(jet, jet_, time_ns);
    const SheetTruth& s0 = sheet[sheet_];
    const SheetTruth& s1 = sheet[std::min(sheet_ + 1, sheet.size() - 1)];
    const JetTruth& j0 = jet[jet_];
    const JetTruth& j1 = jet[std::min(jet_ + 1, jet.size() - 1)];
    const double theta = std::lerp(s0.theta_rad, s1.theta_rad, a);
    const double dx = std::lerp(j0.x_D_mm, j1.x_D_mm, b) - std::lerp(s0.x_mm, s1.x_mm, a);
    const double dy = std::lerp(j0.y_D_mm, j1.y_D_mm, b) - std::lerp(s0.y_mm, s1.y_mm, a);
    const double c = std::cos(theta);
    const double s = std::sin(theta);
    return {c * dx + s * dy, c * dy - s * dx};
  }

 private:
  template <class Sample>
  static double Advance(const std::vector<Sample>& samples, std::size_t& at, std::int64_t time_ns) {
    while (at + 1 < samples.size() && samples[at + 1].time_ns <= time_ns) {
      ++at;
    }
    if (at + 1 >= samples.size() || time_ns <= samples[at].time_ns) {
      return 0.0;
    }
    return static_cast<double>(time_ns - samples[at].time_ns) /
           static_cast<double>(samples[at + 1].time_ns - samples[at].time_ns);
  }

  const Truth& truth_;
  std::size_t sheet_ = 0;
  std::size_t jet_ = 0;
};

// T f' + f = p, exact for a jet that moves straight between two stamps.
class TrailingFront {
 public:
  explicit TrailingFront(double lag_time_s) : lag_time_s_(lag_time_s) {}

  void Start(const Eigen::Vector2d& jet) { front_ = jet_ = jet; }

  Eigen::Vector2d Follow(double step_s, const Eigen::Vector2d& jet) {
    if (lag_time_s_ <= 0.0) {
      front_ = jet;
    } else if (step_s > 0.0) {
      const Eigen::Vector2d velocity = (jet - jet_) / step_s;
      const double stays = std::exp(-step_s / lag_time_s_);
      const Eigen::Vector2d offset = front_ - jet_ + lag_time_s_ * velocity;
      front_ = jet - lag_time_s_ * velocity + stays * offset;
    }
    jet_ = jet;
    return front_;
  }

 private:
  double lag_time_s_;
  Eigen::Vector2d front_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d jet_ = Eigen::Vector2d::Zero();
};

struct Stretch {
  std::int64_t begin_ns;
  std::int64_t end_ns;
};

std::vector<Stretch> WaterOn(const Truth& truth, std::int64_t first_ns, std::int64_t last_ns) {
  std::vector<Stretch> stretches;
  bool on = truth.jet_on_at_start;
  std::int64_t since = first_ns;
  for (const WaterSwitch& s : truth.switches) {
    if (s.on == on) {
      continue;
    }
    if (on) {
      stretches.push_back({since, s.time_ns});
    }
    on = s.on;
    since = s.time_ns;
  }
  if (on) {
    stretches.push_back({since, last_ns});
  }
  for (Stretch& s : stretches) {
    s.begin_ns = std::clamp(s.begin_ns, first_ns, last_ns);
    s.end_ns = std::clamp(s.end_ns, first_ns, last_ns);
  }
  std::erase_if(stretches, [](const Stretch& s) { return s.end_ns <= s.begin_ns; });
  return stretches;
}

template <class Sample>
void AddStamps(const std::vector<Sample>& samples, const Stretch& stretch,
               std::vector<std::int64_t>& stamps) {
  auto at = std::ranges::upper_bound(samples, stretch.begin_ns, {}, &Sample::time_ns);
  for (; at != samples.end() && at->time_ns < stretch.end_ns; ++at) {
    stamps.push_back(at->time_ns);
  }
}

// Every sheet stamp within, and both ends. The jet hardly moves; its stamps add nothing.
std::vector<std::int64_t> StampsOf(const Truth& truth, const Stretch& stretch) {
  std::vector<std::int64_t> stamps{stretch.begin_ns};
  AddStamps(truth.sheet, stretch, stamps);
  stamps.push_back(stretch.end_ns);
  return stamps;
}

bool Within(const std::vector<Stretch>& stretches, std::int64_t from_ns, std::int64_t to_ns) {
  return std::ranges::any_of(stretches,
                             [=](const Stretch& s) { return s.begin_ns < to_ns && from_ns < s.end_ns; });
}

template <class Sample>
void CountMissing(const std::vector<Sample>& samples, const std::vector<Stretch>& on, CutPath& path) {
  const std::int64_t period_ns = Period(samples);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const std::int64_t step = samples[i].time_ns - samples[i - 1].time_ns;
    const auto lost =
        static_cast<std::uint64_t>(std::max<std::int64_t>(0, (step + period_ns / 2) / period_ns - 1));
    if (lost > 0) {
      (Within(on, samples[i - 1].time_ns, samples[i].time_ns) ? path.missing : path.missing_idle) += lost;
    }
  }
}

}  // namespace

CutPath JoinTruth(Truth truth) {
  CutPath path;
  SortByTime(truth.sheet);
  SortByTime(truth.jet);
  std::ranges::stable_sort(truth.switches, {}, &WaterSwitch::time_ns);
  path.samples = truth.sheet.size();
  if (truth.sheet.empty() || truth.jet.empty()) {
    return path;
  }
  const std::int64_t first = std::max(truth.sheet.front().time_ns, truth.jet.front().time_ns);
  const std::int64_t last = std::min(truth.sheet.back().time_ns, truth.jet.back().time_ns);
  const std::vector<Stretch> on = WaterOn(truth, first, last);
  CountMissing(truth.sheet, on, path);
  CountMissing(truth.jet, on, path);
  Interpolator interpolate(truth);
  for (const Stretch& stretch : on) {
    TrailingFront front(truth.lag_time_s);
    front.Start(interpolate.JetOnSheet(stretch.begin_ns));
    Cut cut;
    std::int64_t before = stretch.begin_ns;
    for (const std::int64_t stamp : StampsOf(truth, stretch)) {
      cut.push_back(
          {Seconds(stamp - first), front.Follow(Seconds(stamp - before), interpolate.JetOnSheet(stamp))});
      before = stamp;
    }
    path.cutting_time_s += Seconds(stretch.end_ns - stretch.begin_ns);
    path.cuts.push_back(std::move(cut));
  }
  return path;
}

}  // namespace lambdajet::inspection
