#include "trajectory/core/feed/early_plan.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace lambdajet::trajectory {
namespace {

constexpr std::string_view kEnd = "\nM2\n";

// The program's first lines, ended; empty if they are all of it.
std::string FirstLines(std::string_view program, std::size_t lines) {
  std::size_t at = 0;
  for (std::size_t k = 0; k < lines; ++k) {
    const std::size_t end = program.find('\n', at);
    if (end == std::string_view::npos) {
      return {};
    }
    at = end + 1;
  }
  return at >= program.size() ? std::string() : std::string(program.substr(0, at)).append(kEnd);
}

// Gives a sink what it has not had, if all it has had is still so.
class Outlet {
 public:
  explicit Outlet(const SegmentSink& sink) : sink_(sink) {}

  enum class Answer { kGiven, kDiffers, kCancelled };

  Answer Give(std::span<const Segment> segments) {
    std::uint64_t mark = kBegin;
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (i == given_ && mark != mark_) {
        return Answer::kDiffers;
      }
      mark = Mixed(mark, segments[i]);
    }
    if (segments.size() < given_ || (segments.size() == given_ && mark != mark_)) {
      return Answer::kDiffers;
    }
    const std::span<const Segment> rest = segments.subspan(given_);
    given_ = segments.size();
    mark_ = mark;
    return rest.empty() || sink_(rest) ? Answer::kGiven : Answer::kCancelled;
  }

  std::size_t given() const { return given_; }

 private:
  static constexpr std::uint64_t kBegin = 14695981039346656037ull;

  static std::uint64_t Mixed(std::uint64_t mark, const Segment& s) {
    const auto number = [&mark](double value) {
      mark = (mark ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211ull;
      mark ^= mark >> 29;
    };
    number(s.start_s);
    number(s.duration_s);
    number(static_cast<double>(s.gate_at_end));
    for (const Polynomial* p : {&s.q_mm[0], &s.q_mm[1], &s.lead_mm[0], &s.lead_mm[1], &s.s_mm}) {
      for (const double c : p->c) {
        number(c);
      }
    }
    return mark;
  }

  const SegmentSink& sink_;
  std::size_t given_ = 0;
  std::uint64_t mark_ = kBegin;
};

// Those that end long enough before the plan does.
std::span<const Segment> Settled(const Plan& plan, double withheld_s) {
  const auto end = std::partition_point(plan.segments.begin(), plan.segments.end(), [&](const Segment& s) {
    return s.start_s + s.duration_s <= plan.duration_s - withheld_s;
  });
  return {plan.segments.begin(), end};
}

}  // namespace

PlannedProgram PlanWithEarlySegments(std::string_view program, const MachineDescription& machine,
                                     const PlanOptions& options, const SegmentSink& sink,
                                     const EarlyLook& look, const PlanProgress& progress) {
  Outlet outlet(sink);
  const auto refused = [](Outlet::Answer answer) {
    PlannedProgram result;
    const bool cancelled = answer == Outlet::Answer::kCancelled;
    result.faults.push_back({0, 0, cancelled ? "CANCELLED" : "EARLY_SEGMENTS_DIFFER", "",
                             cancelled
                                 ? "planning was cancelled"
                                 : "the whole plan is not the continuation of what was given out early"});
    return result;
  };
  const auto alive = [&progress](double) { return !progress || progress(0.0); };
  // A resume begins where the whole path says: nothing of it is known early.
  for (std::size_t lines = look.first_lines; !options.start_from_s_mm; lines *= look.growth) {
    const std::string first = FirstLines(program, lines);
    if (first.empty() || first.size() > program.size() / 2) {
      break;
    }
    const PlannedProgram early = PlanPartProgram(first, machine, options, alive);
    if (!early.faults.empty()) {
      continue;
    }
    if (const auto answer = outlet.Give(Settled(early.plan, look.withheld_s));
        answer != Outlet::Answer::kGiven) {
      return refused(answer);
    }
  }
  PlannedProgram whole = PlanPartProgram(program, machine, options, progress);
  if (!whole.faults.empty()) {
    return whole;
  }
  const auto answer = outlet.Give(whole.plan.segments);
  return answer == Outlet::Answer::kGiven ? whole : refused(answer);
}

}  // namespace lambdajet::trajectory
