// Calculates several poses in one register: a bundle of doubles that the closure kernel takes for a scalar.
//
// Model: every operation acts on all lanes; comparisons give a mask, and a mask selects. Branches that the
// kernel takes on a scalar's sign are selections here. Shapes: N = 2 (every x86-64 and AArch64), 4 (AVX2), 8
// (AVX-512). Threads: values. Cost: one SIMD instruction an operation.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace lambdajet::kinematics::lambda {

template <int N>
struct Register;  // the compiler's vector types, one for each width
template <>
struct Register<2> {
  using Bundle = double __attribute__((vector_size(16)));
  using Bits = std::int64_t __attribute__((vector_size(16)));
};
template <>
struct Register<4> {
  using Bundle = double __attribute__((vector_size(32)));
  using Bits = std::int64_t __attribute__((vector_size(32)));
};
template <>
struct Register<8> {
  using Bundle = double __attribute__((vector_size(64)));
  using Bits = std::int64_t __attribute__((vector_size(64)));
};

template <int N>
struct LaneMask {
  using Bits = typename Register<N>::Bits;
  Bits bits;
  friend LaneMask operator&(LaneMask a, LaneMask b) { return {a.bits & b.bits}; }
  bool AllSet() const {
    std::int64_t all = -1;
    for (int i = 0; i < N; ++i) {
      all &= bits[i];
    }
    return all != 0;
  }
};

template <int N>
struct Lanes {
  using Bundle = typename Register<N>::Bundle;
  Bundle lanes;

  Lanes() = default;
  Lanes(double everywhere) : lanes(Bundle{} + everywhere) {}
  explicit Lanes(Bundle b) : lanes(b) {}

  friend Lanes operator+(Lanes a, Lanes b) { return Lanes(a.lanes + b.lanes); }
  friend Lanes operator-(Lanes a, Lanes b) { return Lanes(a.lanes - b.lanes); }
  friend Lanes operator*(Lanes a, Lanes b) { return Lanes(a.lanes * b.lanes); }
  friend Lanes operator/(Lanes a, Lanes b) { return Lanes(a.lanes / b.lanes); }
  friend Lanes operator-(Lanes a) { return Lanes(-a.lanes); }
  friend LaneMask<N> operator<(Lanes a, Lanes b) { return {a.lanes < b.lanes}; }
  friend LaneMask<N> operator>(Lanes a, Lanes b) { return {a.lanes > b.lanes}; }
  friend LaneMask<N> operator<=(Lanes a, Lanes b) { return {a.lanes <= b.lanes}; }
  friend LaneMask<N> operator>=(Lanes a, Lanes b) { return {a.lanes >= b.lanes}; }
  friend Lanes Select(LaneMask<N> mask, Lanes a, Lanes b) { return Lanes(mask.bits ? a.lanes : b.lanes); }
  friend Lanes Abs(Lanes a) {
    using Bits = typename LaneMask<N>::Bits;
    return Lanes(reinterpret_cast<Bundle>(reinterpret_cast<Bits>(a.lanes) & (Bits{} + INT64_MAX)));
  }
  friend Lanes sqrt(Lanes a) {
    for (int i = 0; i < N; ++i) {
      a.lanes[i] = std::sqrt(a.lanes[i]);
    }
    return a;
  }
};

template <int N>
Lanes<N> RootOrZero(const Lanes<N>& radicand) {
  const Lanes<N> zero(0.0);
  return sqrt(Select(radicand > zero, radicand, zero));
}

template <int N>
Lanes<N> SideOf(const Lanes<N>& forward_mm, double assembly_mode, bool rails_apart) {
  const Lanes<N> side(assembly_mode);
  return rails_apart ? side : Select(forward_mm < Lanes<N>(0.0), -side, side);
}

// N pairs [x0 y0 x1 y1 …] taken apart and put together again.
template <int N>
struct Pairs {
  Lanes<N> first;
  Lanes<N> second;
};

template <int N>
Pairs<N> LoadPairs(const double* from) {
  Pairs<N> pairs;
  for (int i = 0; i < N; ++i) {
    pairs.first.lanes[i] = from[2 * i];
    pairs.second.lanes[i] = from[2 * i + 1];
  }
  return pairs;
}

template <int N>
void StorePairs(const Pairs<N>& pairs, double* to) {
  for (int i = 0; i < N; ++i) {
    to[2 * i] = pairs.first.lanes[i];
    to[2 * i + 1] = pairs.second.lanes[i];
  }
}

}  // namespace lambdajet::kinematics::lambda
