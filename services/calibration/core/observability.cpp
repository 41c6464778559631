#include "calibration/core/observability.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>

#include "calibration/core/look_model.hpp"

namespace lambdajet::calibration {
namespace {

constexpr double kRankTolerance = 1e-11;  // of eigenvalues, squares of singular values
constexpr double kUnseen = 1e-2;          // information below which a gauge counts as found

struct Gauge {
  ParameterVector direction = ParameterVector::Zero();
  std::string words;
};

ParameterVector Along(std::initializer_list<std::pair<Parameter, double>> entries) {
  ParameterVector v = ParameterVector::Zero();
  for (const auto& [parameter, value] : entries) {
    v[At(parameter)] = value;
  }
  return v;
}

std::vector<Gauge> KnownGauges(const ParameterVector& p) {
  using P = Parameter;
  const double c = std::cos(p[At(P::kBaseThetaRad)]);
  const double s = std::sin(p[At(P::kBaseThetaRad)]);
  return {
      {Along({{P::kBaseXMm, 1.0}, {P::kSheetXMm, 1.0}}),
       "base_x_mm and sheet_x_mm moving together: looks and cuts see only their difference"},
      {Along({{P::kBaseYMm, 1.0}, {P::kSheetYMm, 1.0}}),
       "base_y_mm and sheet_y_mm moving together: looks and cuts see only their difference"},
      {Along({{P::kSlider1ZeroMm, 1.0}, {P::kSlider2ZeroMm, 1.0}, {P::kBaseXMm, 1.0}}),
       "both slider zeros moving together with base_x_mm: the drive module slides along its own rail"},
      {Along({{P::kRail1OffsetMm, 1.0}, {P::kRail2OffsetMm, 1.0}, {P::kBaseYMm, 1.0}}),
       "both rail offsets moving together with base_y_mm: D's origin slides across the rail"},
      {Along({{P::kRail1AngleRad, 1.0},
              {P::kRail2AngleRad, 1.0},
              {P::kSlider1ZeroMm, -p[At(P::kRail1OffsetMm)]},
              {P::kSlider2ZeroMm, -p[At(P::kRail2OffsetMm)]},
              {P::kBaseXMm, -p[At(P::kBaseYMm)]},
              {P::kBaseYMm, p[At(P::kBaseXMm)]},
              {P::kBaseThetaRad, 1.0},
              {P::kSheetXMm, -p[At(P::kSheetYMm)]},
              {P::kSheetYMm, p[At(P::kSheetXMm)]},
              {P::kSheetThetaRad, 1.0}}),
       "rail angles, base_theta_rad and sheet_theta_rad turning together: D's x axis is free to turn"},
      {Along({{P::kCameraXMm, 1.0}, {P::kBaseXMm, -c}, {P::kBaseYMm, -s}}),
       "camera_x_mm against the base: without a look at a pierced hole the jet's own place is not seen"},
      {Along({{P::kCameraYMm, 1.0}, {P::kBaseXMm, s}, {P::kBaseYMm, -c}}),
       "camera_y_mm against the base: without a look at a pierced hole the jet's own place is not seen"},
      {Along({{P::kElasticLagS2, 1.0}}), "elastic_lag_s2: no picture was taken while the sheet accelerated"},
      {Along({{P::kDampingTimeS, 1.0}}), "damping_time_s: no picture was taken while the sheet accelerated"},
  };
}

// The direction in z, unit length; none if a parameter that must move with it is known exactly.
std::optional<ParameterVector> Scaled(const Prior& prior, const ParameterVector& direction) {
  const ParameterVector z = prior.scale.completeOrthogonalDecomposition().solve(direction);
  const double reach = (prior.scale * z - direction).norm();
  if (!(z.norm() > 0.0) || reach > 1e-9 * direction.norm()) {
    return std::nullopt;
  }
  return ParameterVector(z / z.norm());
}

}  // namespace

std::string DescribeDirection(const ParameterVector& z_direction) {
  std::array<int, kParameterCount> order{};
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(z_direction[a]) > std::abs(z_direction[b]); });
  std::string words;
  for (std::size_t k = 0; k < 4; ++k) {
    const double component = z_direction[order[k]];
    if (std::abs(component) < 0.2) {
      break;
    }
    char text[96];
    const std::string name(ParameterName(static_cast<Parameter>(order[k])));
    std::snprintf(text, sizeof text, "%s%s %+.2f", words.empty() ? "" : ", ", name.c_str(), component);
    words += text;
  }
  return words;
}

Observability Observe(const Prior& prior, const ParameterCovariance& information) {
  Observability seen;
  const Eigen::SelfAdjointEigenSolver<ParameterCovariance> eigen(information);
  seen.eigenvalues = eigen.eigenvalues().cwiseMax(0.0);
  const double largest = seen.eigenvalues[kAll - 1];
  double smallest = largest;
  for (int i = kAll - 1; i >= 0; --i) {
    seen.informed += seen.eigenvalues[i] > 1.0;
    if (largest > 0.0 && seen.eigenvalues[i] > kRankTolerance * largest) {
      ++seen.rank;
      smallest = seen.eigenvalues[i];
    }
  }
  seen.condition = smallest > 0.0 ? std::sqrt(largest / smallest) : 0.0;

  // Gauges found are taken out, so that the weak combinations that remain are named on their own.
  std::vector<ParameterVector> basis;
  ParameterCovariance keep = ParameterCovariance::Identity();
  for (const Gauge& gauge : KnownGauges(prior.mean)) {
    const auto z = Scaled(prior, gauge.direction);
    if (!z || z->dot(information * *z) > kUnseen) {
      continue;
    }
    seen.gauges.push_back(gauge.words);
    ParameterVector rest = *z;
    for (const ParameterVector& b : basis) {
      rest -= b.dot(rest) * b;
    }
    if (rest.norm() > 1e-6) {
      basis.push_back(rest / rest.norm());
      keep -= basis.back() * basis.back().transpose();
    }
  }
  // Directions taken out get an eigenvalue that nothing else has.
  const double marker = -1.0;
  const ParameterCovariance rest =
      keep * information * keep + marker * (ParameterCovariance::Identity() - keep);
  const Eigen::SelfAdjointEigenSolver<ParameterCovariance> of_rest(rest);
  for (int i = 0; i < kAll; ++i) {
    const double value = of_rest.eigenvalues()[i];
    const ParameterVector z = of_rest.eigenvectors().col(i);
    if (value < -0.5 || value >= 1.0 || (prior.scale * z).norm() <= 1e-12) {
      continue;  // taken out, well determined, or known exactly
    }
    char text[128];
    std::snprintf(text, sizeof text, "; the looks add %.0f %% to what the machine file knows",
                  100.0 * std::max(0.0, value));
    seen.weak.push_back({std::max(0.0, value), prior.scale * z, DescribeDirection(z) + text});
  }
  return seen;
}

}  // namespace lambdajet::calibration
