#include <algorithm>
#include <array>
#include <cmath>

#include "trajectory/core/part_program/cldata_verification_walks.hpp"

namespace lambdajet::trajectory {
namespace {

constexpr double kRounding = 1e-9;   // of written coordinates, mm and rad
constexpr std::size_t kStencil = 3;  // points to each side of one
constexpr std::size_t kWindow = 14;  // neighbourhood that a break is compared with
constexpr double kOutstanding = 12.0;

struct Derivatives {
  double first = 0.0, second = 0.0;
};

// First and second derivative at x[0] of the cubic through four points, by Newton's divided differences.
Derivatives CubicAt(const std::array<double, 4>& x, const std::array<double, 4>& y) {
  const double f01 = (y[1] - y[0]) / (x[1] - x[0]), f12 = (y[2] - y[1]) / (x[2] - x[1]),
               f23 = (y[3] - y[2]) / (x[3] - x[2]);
  const double f012 = (f12 - f01) / (x[2] - x[0]), f123 = (f23 - f12) / (x[3] - x[1]);
  const double f0123 = (f123 - f012) / (x[3] - x[0]);
  const double a = x[0] - x[1], b = x[0] - x[2];
  return {f01 + f012 * a + f0123 * a * b, 2.0 * f012 + 2.0 * f0123 * (a + b)};
}

// One piece of one coordinate: what both sides say at every point.
struct Sides {
  std::vector<Derivatives> before, after;
  std::vector<double> first_gap, second_gap;  // after - before
};

Sides SidesOf(const std::vector<double>& x, const std::vector<double>& y, std::size_t from, std::size_t to) {
  const std::size_t n = to - from;
  Sides s{std::vector<Derivatives>(n), std::vector<Derivatives>(n), std::vector<double>(n),
          std::vector<double>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    const auto cubic = [&](int step) {
      std::array<double, 4> u, v;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto at = static_cast<std::size_t>(static_cast<long>(from + i) + step * static_cast<long>(k));
        u[k] = x[at];
        v[k] = y[at];
      }
      return CubicAt(u, v);
    };
    const bool has_before = i >= kStencil, has_after = i + kStencil < n;
    s.before[i] = cubic(has_before ? -1 : 1);
    s.after[i] = cubic(has_after ? 1 : -1);
    if (has_before && has_after) {
      s.first_gap[i] = s.after[i].first - s.before[i].first;
      s.second_gap[i] = s.after[i].second - s.before[i].second;
    }
  }
  return s;
}

double Median(std::vector<double>& values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Larger of the medians of what lies before and behind a point, out of its own stencils.
double Usual(const std::vector<double>& gap, std::size_t i) {
  std::vector<double> before, behind;
  for (std::size_t k = kStencil + 1; k <= kWindow; ++k) {
    if (i >= k + kStencil) {
      before.push_back(std::abs(gap[i - k]));
    }
    if (i + k + kStencil < gap.size()) {
      behind.push_back(std::abs(gap[i + k]));
    }
  }
  return std::max(Median(before), Median(behind));
}

class SampleSearch {
 public:
  SampleSearch(ProgramVerification& result, std::size_t coordinate, std::size_t from, std::size_t to)
      : result_(result),
        coordinate_(coordinate),
        from_(from),
        sides_(SidesOf(result.arguments, result.series[coordinate].values, from, to)) {}

  void Run() {
    const std::size_t n = sides_.before.size();
    for (std::size_t i = kStencil; i + kStencil < n;) {
      if (!Stands(i)) {
        ++i;
        continue;
      }
      std::size_t last = i;
      for (std::size_t k = i + 1; k + kStencil < n && k <= last + kStencil; ++k) {
        last = Stands(k) ? k : last;
      }
      Tell(i, last);
      i = last + kStencil + 1;
    }
    Fill(n);
  }

 private:
  double Step(std::size_t i) const { return result_.arguments[from_ + i + 1] - result_.arguments[from_ + i]; }

  bool Stands(std::size_t i) const {
    const double h = Step(i);
    return std::abs(sides_.first_gap[i]) > kOutstanding * Usual(sides_.first_gap, i) + 20.0 * kRounding / h ||
           std::abs(sides_.second_gap[i]) >
               kOutstanding * Usual(sides_.second_gap, i) + 60.0 * kRounding / (h * h);
  }

  static std::size_t Largest(const std::vector<double>& gap, std::size_t from, std::size_t to) {
    std::size_t best = from;
    for (std::size_t i = from; i <= to; ++i) {
      best = std::abs(gap[i]) > std::abs(gap[best]) ? i : best;
    }
    return best;
  }

  // A jump of z leaves first gaps of +-11/6 z/h at both of its points.
  void Tell(std::size_t from, std::size_t to) {
    const std::size_t one = Largest(sides_.first_gap, from, to);
    const std::size_t next = one + 1 < sides_.first_gap.size() ? one + 1 : one;
    const double v = sides_.first_gap[one], h = Step(one);
    const double ahead = sides_.first_gap[next], behind = one > 0 ? sides_.first_gap[one - 1] : 0.0;
    if (-ahead * v > 0.92 * v * v || -behind * v > 0.92 * v * v) {
      const bool at_one = -ahead * v > -behind * v;
      const double size = (at_one ? v : behind) * h * 6.0 / 11.0;
      if (Jumps(at_one ? one : one - 1, size)) {
        Add(at_one ? next : one, 0, size);
        return;
      }
    }
    const Fit fit = BestFit(from, to);
    const double kink = kKinkNorm * std::abs(fit.kink), step = kStepNorm * std::abs(fit.step);
    const double most = std::max({kink, step, kThirdNorm * std::abs(fit.third)});
    if (kink > kShare * most) {
      Add(fit.at, 1, fit.kink);
    } else if (step > kShare * most) {
      Add(fit.at, 2, fit.step / Step(fit.at));
    }
  }

  // What a kink, a step of the second and one of the third derivative (times h and h^2) leave in the first and second gaps
  // (times h) of the five points around them; in parts of 36, for even steps.
  static constexpr std::array<double, 10> kKink = {12, -30, 36, -30, 12, -36, 72, 0, -72, 36};
  static constexpr std::array<double, 10> kStep = {6, -3, 0, 3, -6, -18, 0, 36, 0, -18};
  static constexpr std::array<double, 10> kThird = {2, 7, 0, 7, 2, -6, -24, 0, 24, 6};
  static constexpr double kKinkNorm = 3.55, kStepNorm = 1.25, kThirdNorm = 1.01;
  static constexpr double kShare = 0.3;  // of the largest: less is what the others leak

  struct Fit {
    std::size_t at = 0;
    double kink = 0.0, step = 0.0, third = 0.0;
  };

  static double Product(const std::array<double, 10>& a, const std::array<double, 10>& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      sum += a[k] * b[k];
    }
    return sum;
  }

  // Least squares over the three at every point of the cluster; the point that leaves least is where it breaks.
  Fit BestFit(std::size_t from, std::size_t to) const {
    Fit best;
    double least = 1e300;
    const double vv = Product(kKink, kKink), vj = Product(kKink, kThird), jj = Product(kThird, kThird);
    for (std::size_t i = std::max<std::size_t>(from, 2); i <= to && i + 3 < sides_.before.size(); ++i) {
      std::array<double, 10> gaps;
      for (std::size_t k = 0; k < 5; ++k) {
        gaps[k] = 36.0 * sides_.first_gap[i + k - 2];
        gaps[k + 5] = 36.0 * sides_.second_gap[i + k - 2] * Step(i);
      }
      const double v = Product(kKink, gaps), a = Product(kStep, gaps), j = Product(kThird, gaps);
      const double determinant = vv * jj - vj * vj;
      const Fit fit{i, (jj * v - vj * j) / determinant, a / Product(kStep, kStep),
                    (vv * j - vj * v) / determinant};
      const double left = Product(gaps, gaps) - fit.kink * v - fit.step * a - fit.third * j;
      if (left < least) {
        least = left;
        best = fit;
      }
    }
    return best;
  }

  // Whether the value jumps by so much from point i to the next: both sides foretell the point beyond wrong by it.
  bool Jumps(std::size_t i, double size) const {
    if (i < kStencil || i + 4 >= sides_.before.size()) {
      return false;
    }
    const double before = std::abs(FourthDifference(i + 1, -1)), after = std::abs(FourthDifference(i, 1));
    return std::abs(before - std::abs(size)) < 0.2 * std::abs(size) &&
           std::abs(after - std::abs(size)) < 0.2 * std::abs(size);
  }

  // Of the point and the four before (-1) or behind (1) it, as if evenly spaced.
  double FourthDifference(std::size_t i, int side) const {
    static constexpr std::array<double, 5> kWeights = {1.0, -4.0, 6.0, -4.0, 1.0};
    const std::vector<double>& y = result_.series[coordinate_].values;
    double sum = 0.0;
    for (std::size_t k = 0; k < kWeights.size(); ++k) {
      sum += kWeights[k] * y[side > 0 ? from_ + i + k : from_ + i - k];
    }
    return sum;
  }

  void Add(std::size_t i, int order, double size) {
    result_.breaks.push_back(
        {result_.lines[from_ + i], coordinate_, order, result_.arguments[from_ + i], size});
    places_.push_back(i);
  }

  // Derivatives for drawing and peaks, from the side that no break spoils.
  void Fill(std::size_t n) {
    CoordinateSeries& series = result_.series[coordinate_];
    for (std::size_t i = 0; i < n; ++i) {
      const bool break_ahead = Near(i, 1), break_behind = Near(i, -1);
      const Derivatives &b = sides_.before[i], &a = sides_.after[i];
      const Derivatives d = break_ahead ? b
                            : break_behind
                                ? a
                                : Derivatives{0.5 * (a.first + b.first), 0.5 * (a.second + b.second)};
      series.first[from_ + i] = d.first;
      series.second[from_ + i] = d.second;
      if (!(break_ahead && break_behind)) {
        series.peak_first = std::max(series.peak_first, std::abs(d.first));
        series.peak_second = std::max(series.peak_second, std::abs(d.second));
      }
    }
  }

  bool Near(std::size_t i, int side) const {
    return std::any_of(places_.begin(), places_.end(), [&](std::size_t p) {
      return side > 0 ? p >= i && p <= i + kStencil : p < i && p + kStencil >= i;
    });
  }

  ProgramVerification& result_;
  std::size_t coordinate_, from_;
  Sides sides_;
  std::vector<std::size_t> places_;
};

}  // namespace

void SearchPiece(ProgramVerification& result, std::size_t coordinate, std::size_t from, std::size_t to) {
  SampleSearch(result, coordinate, from, to).Run();
}

}  // namespace lambdajet::trajectory
