// The planar core's solves allocate nothing: every operator new of this program is counted.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <new>

#include "kinematics/core/lambda_block.hpp"
#include "kinematics/core/lambda_mechanism.hpp"
#include "kinematics/core/swept_collision.hpp"
#include "kinematics/core/workspace.hpp"

namespace {
std::atomic<long> allocations = 0;
}

// The compiler sees malloc and free through these where it inlines them, and takes them for a pair that does not match.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace lambdajet::kinematics {
namespace {

TEST(Allocation, TheHookCounts) {
  const long before = allocations;
  void* memory = ::operator new(8);
  asm volatile("" : : "r"(memory) : "memory");  // or the pair is optimised away
  ::operator delete(memory);
  EXPECT_EQ(allocations - before, 1);
}

TEST(Allocation, SolvesMakeNone) {
  const auto m = LambdaMechanism::FromParameters(IdealLambda(1200, 600, 700));
  std::array<double, 2 * 1000> poses, out;
  std::array<Reason, 1000> reasons;
  for (std::size_t i = 0; i < 1000; ++i) {
    poses[2 * i] = static_cast<double>(i);
    poses[2 * i + 1] = 1.3 * static_cast<double>(i);  // in and out of reach
  }
  const auto sheet = SheetCorners({}, 100.0, 50.0);
  const auto body = BodyCorners(0.0, 300.0, 10.0, 400.0);
  const std::array<Corners, 1> bodies = {body};
  const std::array<Eigen::Vector2d, 2> path = {Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 500)};
  double sum = 0.0;
  const long before = allocations;
  for (std::size_t i = 0; i < 1000; ++i) {
    const Eigen::Vector2d p(poses[2 * i], poses[2 * i + 1]);
    const Motion motion{p, {1.0, 2.0}, {3.0, 4.0}};
    sum += SolveInverse(m, p).excess_mm + SolveForward(m, p).excess_mm;
    sum += SolveInverseMotion(m, motion).motion.velocity_mm_per_s.x() +
           SolveForwardMotion(m, motion).motion.velocity_mm_per_s.x();
    sum += ComputeJacobians(m, p).determinant + ReportSingularity(m, p).determinant +
           FindUsableMargin(m, p).margin_mm;
  }
  SolveInverseBatch(m, poses, out, reasons);
  SolveForwardBatch(m, out, poses, reasons);
  sum += SweepSheet(sheet, path, bodies).clearance_mm;
  EXPECT_EQ(allocations - before, 0);
  EXPECT_NE(sum, 0.0);
}

// Every width of the batch that this processor has gives the same numbers.
TEST(LambdaBlock, WidthsAgree) {
#if defined(__x86_64__)
  std::vector<lambda::BlockSolvers> widths = {lambda::TwoLaneSolvers()};
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    widths.push_back(lambda::FourLaneSolvers());
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    widths.push_back(lambda::EightLaneSolvers());
  }
#else
  const std::vector<lambda::BlockSolvers> widths = {lambda::TwoLaneSolvers()};
#endif
  MechanismParameters p = IdealLambda(1200.7, 599.4, 701.3);
  p.tail<6>() << 1.5e-3, 0.31, -0.9e-3, -0.42, 12.5, -7.25;
  for (const bool straight : {true, false}) {
    const auto m = LambdaMechanism::FromParameters(straight ? IdealLambda(1200, 600, 700) : p);
    const lambda::BlockMechanism block{m.geometry, m.parameters[1], 1,      1,       1,     false, straight,
                                       20.0,       -2000.0,         2000.0, -2000.0, 2000.0};
    constexpr std::size_t kCount = 256;
    std::vector<double> poses(2 * kCount), first(2 * kCount), out(2 * kCount), back(2 * kCount);
    std::vector<std::int64_t> clear(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      poses[2 * i] = -600.0 + 5.0 * static_cast<double>(i);
      poses[2 * i + 1] = 100.0 + 4.0 * static_cast<double>(i);
    }
    widths[0].inverse(block, poses.data(), kCount, first.data(), clear.data());
    for (const lambda::BlockSolvers& width : widths) {
      EXPECT_TRUE(width.inverse(block, poses.data(), kCount, out.data(), clear.data())) << width.lanes;
      EXPECT_TRUE(width.forward(block, out.data(), kCount, back.data(), clear.data())) << width.lanes;
      for (std::size_t i = 0; i < 2 * kCount; ++i) {
        ASSERT_NEAR(out[i], first[i], 1e-9) << width.lanes;
        ASSERT_NEAR(back[i], poses[i], 1e-9) << width.lanes;
      }
    }
  }
}

}  // namespace
}  // namespace lambdajet::kinematics
