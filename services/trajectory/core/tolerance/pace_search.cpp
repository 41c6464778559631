#include "trajectory/core/tolerance/pace_search.hpp"

#include <algorithm>
#include <cmath>

namespace lambdajet::trajectory {
namespace {

constexpr double kCell_mm = 0.5;
constexpr double kMostCells = 2e6;
constexpr double kLeastPace = 0.02;
constexpr int kRoundsBothWays = 14;
constexpr int kRoundsAgain = 6;  // after a widening
constexpr int kRoundsPlaces = 12;
constexpr int kRoundsDown = 60;
constexpr double kFirstRise = 0.2;
constexpr double kRiseAgain = 0.05;
constexpr double kRiseFades = 0.82;
constexpr double kSettledRise = 1.01;
constexpr double kLeastCut = 0.985;  // of a whole contour
constexpr double kAim = 0.995;       // of the room, so that rounds end inside
constexpr double kFaster = 1e-6;     // of a contour's time
constexpr std::size_t kSmoothCells = 3;
constexpr double kAround_s = 0.03;
constexpr double kPastDecays = 2.5;
constexpr double kSmallestShare = 0.25;  // of the largest contribution to the spring's answer
constexpr double kCounts = 0.2;          // of the moving mean square
constexpr std::array<double, 4> kRises = {1.08, 1.04, 1.02, kLastRise};
constexpr int kMostRises = 6;  // of one size

// Passes that programs take; what is said of progress rests on it, nothing else.
constexpr double kPlanningShare = 0.8;  // of a pass, the rest is judging
constexpr double kBestOnceMore = 1.0;
constexpr double kExploredAgain = 6.0;  // half of the programs are explored once more
constexpr double kPlacesTaken = 2.0;
constexpr double kDownTaken = 1.0;
constexpr double kRaisesTaken = 4.0;
constexpr double kDrawing = 1.0;
constexpr double kFinishTaken = 1.0 + kPlacesTaken + kDownTaken + kRaisesTaken + kDownTaken + kDrawing;

// Of a stage that may take longer than it mostly does.
double Left(double expected) { return std::max(1.0, expected); }

double RunLength(const ProgramPath& path) {
  double run_mm = 0.0;
  for (const PathElement& e : path.elements) {
    run_mm += e.length_mm();
  }
  return run_mm;
}

Pace FullPace(const ProgramPath& path) {
  const double run_mm = RunLength(path);
  Pace pace;
  pace.cell_mm = std::max(kCell_mm, run_mm / kMostCells);
  pace.cells.assign(static_cast<std::size_t>(std::ceil(run_mm / pace.cell_mm)) + 1, 1.0);
  pace.idle.assign(path.elements.size(), 1.0);
  return pace;
}

// Nowhere above `factor`, and without steps that would make accelerations of their own.
std::vector<double> Smoothed(const std::vector<double>& factor) {
  const auto window = [&factor](std::size_t c) {
    return std::pair(c > kSmoothCells ? c - kSmoothCells : 0, std::min(c + kSmoothCells + 1, factor.size()));
  };
  std::vector<double> least(factor.size()), smooth(factor.size());
  for (std::size_t c = 0; c < factor.size(); ++c) {
    const auto [first, end] = window(c);
    least[c] = *std::min_element(factor.begin() + static_cast<std::ptrdiff_t>(first),
                                 factor.begin() + static_cast<std::ptrdiff_t>(end));
  }
  for (std::size_t c = 0; c < factor.size(); ++c) {
    const auto [first, end] = window(c);
    double sum = 0.0;
    for (std::size_t k = first; k < end; ++k) {
      sum += least[k];
    }
    smooth[c] = sum / static_cast<double>(end - first);
  }
  return smooth;
}

}  // namespace

PaceSearch::PaceSearch(const ProgramPath& path, const MachineDescription& machine, const PlanOptions& options,
                       PassProgress& progress)
    : path_(path), machine_(machine), options_(options), progress_(progress) {
  best_pace_ = FullPace(path);
}

bool PaceSearch::Try(const Pace& pace, double left) {
  if (!progress_.Begin(left)) {
    cancelled_ = true;
    return false;
  }
  const PlanProgress wanted = [this](double share) { return progress_.Within(kPlanningShare * share); };
  now_.pace = pace;
  options_.pace = std::make_shared<const Pace>(pace);
  ++plans_;
  now_.planned = PlanLaidOutProgram(path_, machine_, options_, wanted);
  if (!now_.planned.faults.empty()) {
    return false;
  }
  fastest_s_ = plans_ == 1 ? now_.planned.plan.duration_s : fastest_s_;
  now_.judged = JudgeContour(machine_, path_, now_.planned, options_.hold, widening_);
  return true;
}

// A contour's cells reach to the next contour's first, its elements from the last contour's first run to its own.
void PaceSearch::FindContours() {
  contours_.clear();
  for (const JudgedPlace& place : now_.judged.places) {
    const std::size_t contour = now_.judged.groups[place.group].contour;
    const auto cell = static_cast<std::size_t>(place.run_mm / now_.pace.cell_mm);
    while (contours_.size() < contour) {
      const bool first = contours_.empty();
      const std::size_t begin = first ? 0 : std::min(cell, now_.pace.cells.size());
      const std::size_t element = first ? 0 : contours_.back().end_element;
      if (!first) {
        contours_.back().end_cell = begin;
      }
      contours_.push_back({begin, now_.pace.cells.size(), element, place.element, {}});
    }
  }
}

std::vector<PaceSearch::Outcome> PaceSearch::OutcomesNow() const {
  std::vector<Outcome> outcomes(contours_.size());
  double begin_s = 0.0, end_s = 0.0;
  std::size_t last = 0;
  for (const JudgedPlace& place : now_.judged.places) {
    const JudgedGroup& group = now_.judged.groups[place.group];
    const std::size_t c = std::min<std::size_t>(group.contour, contours_.size()) - 1;
    Outcome& outcome = outcomes[c];
    outcome.holds = outcome.holds && place.bound_mm <= group.tolerance_mm;
    outcome.room_ratio = std::min(outcome.room_ratio, place.room_ratio);
    if (c != last) {
      begin_s = end_s;
      last = c;
    }
    end_s = place.time_s;
    outcome.time_s = end_s - begin_s;  // with the way to it
  }
  return outcomes;
}

void PaceSearch::KeepBest() {
  const std::vector<Outcome> outcomes = OutcomesNow();
  for (std::size_t c = 0; c < contours_.size(); ++c) {
    Contour& contour = contours_[c];
    const Outcome& now = outcomes[c];
    const bool better = now.holds ? !contour.best.holds || now.time_s < (1.0 - kFaster) * contour.best.time_s
                                  : !contour.best.holds && now.room_ratio > contour.best.room_ratio;
    if (!contour.known || better) {
      contour.known = true;
      contour.best = now;
      for (std::size_t k = contour.first_cell; k < contour.end_cell; ++k) {
        best_pace_.cells[k] = now_.pace.cells[k];
      }
      for (std::size_t k = contour.first_element; k < contour.end_element; ++k) {
        best_pace_.idle[k] = now_.pace.idle[k];
      }
    }
  }
}

void PaceSearch::AskSample(std::size_t sample, double room_ratio, Pace& factor) const {
  const JudgedContour::SamplePlace& at = now_.judged.samples[sample];
  if (path_.elements[at.element].kind == ElementKind::kIdle) {
    factor.idle[at.element] = std::min(factor.idle[at.element], room_ratio);
    return;
  }
  const auto cell = static_cast<std::size_t>(std::max(0.0, at.run_mm / factor.cell_mm));
  double& there = factor.cells[std::min(cell, factor.cells.size() - 1)];
  there = std::min(there, room_ratio);
}

void PaceSearch::AskAround(const JudgedPlace& place, Pace& factor) const {
  const auto& samples = now_.judged.samples;
  const auto near = [&](std::size_t i) { return std::abs(samples[i].time_s - place.time_s) <= kAround_s; };
  for (std::size_t i = place.sample + 1; i-- > 0 && near(i);) {
    AskSample(i, place.room_ratio, factor);
  }
  for (std::size_t i = place.sample + 1; i < samples.size() && near(i); ++i) {
    AskSample(i, place.room_ratio, factor);
  }
}

void PaceSearch::AskPast(const JudgedPlace& place, Pace& factor) const {
  const auto& samples = now_.planned.samples;
  const double lag = std::max(1e-9, machine_.value(Parameter::kElasticLagS2));
  const double decay = 0.5 * std::max(0.0, machine_.value(Parameter::kDampingTimeS)) / lag;
  const double turn = std::sqrt(std::max(1.0 / lag - decay * decay, 1.0));
  const bool either = options_.compensate || place.elastic_bias_mm == 0.0;
  const double sign = std::copysign(1.0, place.elastic_bias_mm);
  const double memory_s = kPastDecays / std::max(decay, 0.2 * turn);
  std::vector<double> share;
  double largest = 0.0;
  const auto& judged = now_.judged.samples;
  for (std::size_t i = place.sample + 1; i-- > 0 && place.time_s - judged[i].time_s <= memory_s;) {
    const double t = place.time_s - judged[i].time_s;
    const double a = place.n_W.x() * samples[i].ax_W_mm_per_s2 + place.n_W.y() * samples[i].ay_W_mm_per_s2;
    const double answer = -a * std::exp(-decay * t) * std::sin(turn * t);
    share.push_back(either ? std::abs(answer) : sign * answer);
    largest = std::max(largest, share.back());
  }
  for (std::size_t k = 0; k < share.size(); ++k) {
    if (share[k] > kSmallestShare * largest) {
      AskSample(place.sample - k, place.room_ratio, factor);
    }
  }
}

void PaceSearch::Ask(const JudgedPlace& place, Pace& factor) const {
  const double other_bias = place.moving_bias_mm - place.elastic_bias_mm;
  const double elastic = place.elastic_bias_mm * place.elastic_bias_mm + place.elastic_variance_mm2;
  const double others = place.rate_variance_mm2 + place.surge_variance_mm2 - place.elastic_variance_mm2 +
                        other_bias * other_bias + place.rounding_mm * place.rounding_mm;
  if (elastic > kCounts * (elastic + others)) {
    AskPast(place, factor);
  }
  if (others > kCounts * (elastic + others)) {
    AskAround(place, factor);
  }
}

Pace PaceSearch::Changed(double most_rise) const {
  Pace factor = now_.pace;
  factor.cells.assign(factor.cells.size(), most_rise);
  factor.idle.assign(factor.idle.size(), most_rise);
  for (const JudgedPlace& place : now_.judged.places) {
    if (place.room_ratio < most_rise) {
      Ask(place, factor);
    }
  }
  factor.cells = Smoothed(factor.cells);
  Pace pace = now_.pace;
  const auto change = [most_rise](double& of, double asked) {
    of = std::clamp(of * (asked < most_rise ? kAim * asked : most_rise), kLeastPace, 1.0);
  };
  for (std::size_t c = 0; c < pace.cells.size(); ++c) {
    change(pace.cells[c], factor.cells[c]);
  }
  for (std::size_t i = 0; i < pace.idle.size(); ++i) {
    change(pace.idle[i], factor.idle[i]);
  }
  return pace;
}

// holds, and no slowed cell has room to rise.
bool PaceSearch::Settled() const {
  if (!now_.judged.holds) {
    return false;
  }
  const Pace risen = Changed(kMostRoom);
  double most = 1.0;
  for (std::size_t c = 0; c < risen.cells.size(); ++c) {
    most = std::max(most, risen.cells[c] / now_.pace.cells[c]);
  }
  return most < kSettledRise;
}

bool PaceSearch::BothWays(double rise, int rounds) {
  for (int round = 0; round < rounds && !Settled(); ++round, rise *= kRiseFades) {
    if (!Try(Changed(1.0 + rise), Left(rounds - round) + kBestOnceMore + after_)) {
      return false;
    }
    KeepBest();
  }
  return true;
}

void PaceSearch::Scale(const Contour& contour, double factor, Pace& pace) const {
  for (std::size_t c = contour.first_cell; c < contour.end_cell; ++c) {
    pace.cells[c] = std::clamp(pace.cells[c] * factor, kLeastPace, 1.0);
  }
  for (std::size_t i = contour.first_element; i < contour.end_element; ++i) {
    pace.idle[i] = std::clamp(pace.idle[i] * factor, kLeastPace, 1.0);
  }
}

// Only cuts, and only where something is beyond its tolerance.
bool PaceSearch::SlowPlaces() {
  for (int round = 0; round < kRoundsPlaces; ++round) {
    if (std::all_of(contours_.begin(), contours_.end(), [](const Contour& c) { return c.best.holds; })) {
      break;
    }
    if (!Try(Changed(1.0), Left(kPlacesTaken - round) + kDownTaken + kRaisesTaken + after_)) {
      return false;
    }
    KeepBest();
  }
  return true;
}

bool PaceSearch::SlowWholeContours(double after) {
  for (int round = 0; round < kRoundsDown; ++round) {
    if (!Try(best_pace_, Left(kDownTaken - round) + after)) {
      return false;
    }
    if (now_.judged.holds) {
      return true;
    }
    const std::vector<Outcome> outcomes = OutcomesNow();
    for (std::size_t c = 0; c < contours_.size(); ++c) {
      contours_[c].best = outcomes[c];
      if (!outcomes[c].holds) {
        Scale(contours_[c], std::min(kLeastCut, kAim * outcomes[c].room_ratio), best_pace_);
      }
    }
  }
  return true;
}

bool PaceSearch::SlowedIn(const Contour& contour) const {
  const auto slowed = [](const std::vector<double>& of, std::size_t begin, std::size_t end) {
    return std::any_of(of.begin() + static_cast<std::ptrdiff_t>(begin),
                       of.begin() + static_cast<std::ptrdiff_t>(end), [](double p) { return p < 1.0; });
  };
  return slowed(best_pace_.cells, contour.first_cell, contour.end_cell) ||
         slowed(best_pace_.idle, contour.first_element, contour.end_element);
}

// True if some contour became faster and still holds.
bool PaceSearch::RaiseOnce(double step, double left) {
  Pace pace = best_pace_;
  for (Contour& contour : contours_) {
    contour.raising = contour.raising && SlowedIn(contour);
    if (contour.raising) {
      Scale(contour, step, pace);
    }
  }
  if ((pace.cells == best_pace_.cells && pace.idle == best_pace_.idle) || !Try(pace, left)) {
    return false;
  }
  const std::vector<Outcome> outcomes = OutcomesNow();
  bool rose = false;
  for (std::size_t c = 0; c < contours_.size(); ++c) {
    Contour& contour = contours_[c];
    contour.raising =
        contour.raising && outcomes[c].holds && outcomes[c].time_s < (1.0 - kFaster) * contour.best.time_s;
    rose = rose || contour.raising;
  }
  KeepBest();
  return rose;
}

bool PaceSearch::RaiseWholeContours() {
  double sizes_left = kRises.size();
  for (const double step : kRises) {
    for (Contour& contour : contours_) {
      contour.raising = true;
    }
    const double later = --sizes_left * kRaisesTaken / kRises.size() + kDownTaken + after_;
    for (int i = 0; i < kMostRises && RaiseOnce(step, Left(kRaisesTaken / kRises.size() - i) + later); ++i) {
    }
  }
  return !cancelled_ && SlowWholeContours(after_);
}

// Plans at the best pace so far, judged by the new widening.
bool PaceSearch::Begin(const Widening& widening, double left) {
  widening_ = widening;
  if (!Try(best_pace_, left)) {
    return false;
  }
  FindContours();
  KeepBest();
  return true;
}

bool PaceSearch::NoFeedWouldDo() const {
  return std::any_of(now_.judged.places.begin(), now_.judged.places.end(), [this](const JudgedPlace& place) {
    return place.still_bound_mm > now_.judged.groups[place.group].tolerance_mm;
  });
}

PacedPlan PaceSearch::Explore(const Widening& widening) {
  const bool again = !widening.empty();
  const int rounds = again ? kRoundsAgain : kRoundsBothWays;
  after_ = kDrawing + kExploredAgain + kFinishTaken;
  if (!Begin(widening, 1.0 + rounds + kBestOnceMore + after_)) {
    return End(Broken());
  }
  if (now_.judged.reason != accuracy::PredictionReason::kPredicted) {
    return End(now_.judged.reason == accuracy::PredictionReason::kNoCutting ? PaceVerdict::kHolds
                                                                            : PaceVerdict::kRefused);
  }
  if (NoFeedWouldDo()) {
    return End(PaceVerdict::kNotReached);
  }
  if (!BothWays(again ? kRiseAgain : kFirstRise, rounds) || !Try(best_pace_, kBestOnceMore + after_)) {
    return End(Broken());
  }
  return End(PaceVerdict::kHolds);
}

PacedPlan PaceSearch::Finish(const Widening& widening) {
  after_ = kDrawing;
  if (!Begin(widening, kFinishTaken)) {
    return End(Broken());
  }
  if (NoFeedWouldDo()) {
    return End(PaceVerdict::kNotReached);
  }
  if (!SlowPlaces() || !SlowWholeContours(kRaisesTaken + after_) ||
      (now_.judged.holds && !RaiseWholeContours())) {
    return End(Broken());
  }
  return End(now_.judged.holds ? PaceVerdict::kHolds : PaceVerdict::kNotReached);
}

PacedPlan PaceSearch::End(PaceVerdict verdict) {
  PacedPlan plan = now_;
  plan.verdict = verdict;
  plan.plans = plans_;
  plan.fastest_s = fastest_s_;
  return plan;
}

}  // namespace lambdajet::trajectory
