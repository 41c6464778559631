// Prints what the hexapod's solves cost on one core, each beside the same task stated plainly (library sine and cosine,
// Eigen, one strut after the other) in the same run, and the figures published for LinuxCNC's genhexkins.
#include <benchmark/benchmark.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "kinematics/core/hexapod.hpp"
#include "kinematics/core/hexapod_jacobian.hpp"
#include "kinematics/core/hexapod_singularity.hpp"
#include "kinematics/core/service_area.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using worked::kDeg;
constexpr std::size_t kPoses = 1024;  // stays in the first-level cache

struct Workload {
  std::vector<PlatformPose> poses;
  std::array<std::vector<double>, 6> columns;
  std::vector<StrutVector> lengths;
  std::vector<Pose> starts;  // where a path was one step before
};

Workload Along(const Hexapod& hexapod, bool path, double angle_deg) {
  Workload work;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const double a = angle_deg * kDeg;
  for (std::size_t i = 0; i < kPoses; ++i) {
    const double w = 2 * M_PI * static_cast<double>(i) / kPoses;
    const PlatformPose pose =
        path ? PlatformPose{150 * std::sin(w), 150 * std::cos(w),   850 + 100 * std::sin(2 * w),
                            a * std::sin(w),   a * std::sin(2 * w), a * std::cos(w)}
             : PlatformPose{150 * u(random), 150 * u(random), 850 + 100 * u(random),
                            a * u(random),   a * u(random),   a * u(random)};
    work.starts.push_back(path && i > 0 ? work.poses.back().X_MP() : pose.X_MP());
    work.poses.push_back(pose);
    work.lengths.push_back(SolveInverse(hexapod, pose).actuators_mm);
    const std::array<double, 6> raw = {pose.x_mm,    pose.y_mm,      pose.z_mm,
                                       pose.psi_rad, pose.theta_rad, pose.gamma_rad};
    for (std::size_t c = 0; c < 6; ++c) {
      work.columns[c].push_back(raw[c]);
    }
  }
  return work;
}

void PerPose(benchmark::State& state) {
  state.counters["ns_per_pose"] =
      benchmark::Counter(static_cast<double>(state.iterations() * static_cast<long>(kPoses)) * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Equation (1) as one would write it first.
StrutVector PlainLengths(const HexapodGeometry& geometry, const PlatformPose& pose) {
  const Pose X_MP = pose.X_MP();
  StrutVector lengths;
  for (int j = 0; j < kStruts; ++j) {
    lengths[j] = (X_MP * Eigen::Vector3d(geometry.p_PB_mm.col(j)) - geometry.p_MA_mm.col(j)).norm();
  }
  return lengths;
}

// Newton over the six Krylov coordinates as one would write it first.
PlatformPose PlainForward(const HexapodGeometry& geometry, const StrutVector& lengths, PlatformPose pose) {
  for (int i = 0; i < 40; ++i) {
    const KrylovAngles angles{pose.psi_rad, pose.theta_rad, pose.gamma_rad};
    const Pose X_MP = pose.X_MP();
    const Eigen::Matrix3d w_per_rate = angles.AngularVelocityPerRate();
    Eigen::Matrix<double, 6, 6> J;
    StrutVector off;
    for (int j = 0; j < kStruts; ++j) {
      const Eigen::Vector3d turned = X_MP.R * geometry.p_PB_mm.col(j);
      const Eigen::Vector3d s = X_MP.p_mm + turned - geometry.p_MA_mm.col(j);
      const double length = s.norm();
      const Eigen::Vector3d g = s / length;
      off[j] = lengths[j] - length;
      J.row(j) << g.transpose(), turned.cross(g).transpose() * w_per_rate;
    }
    if (off.cwiseAbs().maxCoeff() < 1e-9) {
      break;
    }
    const Eigen::Matrix<double, 6, 1> step = J.partialPivLu().solve(off);
    pose = {pose.x_mm + step[0],    pose.y_mm + step[1],      pose.z_mm + step[2],
            pose.psi_rad + step[3], pose.theta_rad + step[4], pose.gamma_rad + step[5]};
  }
  return pose;
}

const Hexapod& Ideal() {
  static const Hexapod hexapod(worked::Geometry());
  return hexapod;
}
const Hexapod& Real() {
  static const Hexapod hexapod(worked::NonIdealGeometry());
  return hexapod;
}

void InversePlain(benchmark::State& state) {
  const Workload work = Along(Ideal(), false, 15);
  for (auto _ : state) {
    for (const PlatformPose& pose : work.poses) {
      benchmark::DoNotOptimize(PlainLengths(Ideal().geometry(), pose));
    }
  }
  PerPose(state);
}

void InverseSingle(benchmark::State& state) {
  const Workload work = Along(Ideal(), false, 15);
  for (auto _ : state) {
    for (const PlatformPose& pose : work.poses) {
      benchmark::DoNotOptimize(SolveInverse(Ideal(), pose));
    }
  }
  PerPose(state);
}

void InverseBlock(benchmark::State& state) {
  const Workload work = Along(Ideal(), false, 15);
  std::array<std::vector<double>, 6> out;
  PlatformPoseColumns poses;
  StrutLengthColumns lengths;
  for (std::size_t c = 0; c < 6; ++c) {
    out[c].resize(kPoses);
    poses.columns[c] = work.columns[c].data();
    lengths.columns[c] = out[c].data();
  }
  for (auto _ : state) {
    SolveInverseBlock(Ideal(), poses, kPoses, lengths);
    benchmark::ClobberMemory();
  }
  PerPose(state);
}

void InverseNonIdeal(benchmark::State& state) {
  const Workload work = Along(Real(), false, 15);
  for (auto _ : state) {
    for (const PlatformPose& pose : work.poses) {
      benchmark::DoNotOptimize(SolveInverse(Real(), pose));
    }
  }
  PerPose(state);
}

void ForwardPlain(benchmark::State& state, bool path) {
  const Workload work = Along(Ideal(), path, 15);
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoses; ++i) {
      benchmark::DoNotOptimize(PlainForward(Ideal().geometry(), work.lengths[i],
                                            path ? work.poses[i == 0 ? 0 : i - 1] : worked::kPoses[0]));
    }
  }
  PerPose(state);
}

// Including the reading of Krylov angles off the answer.
void Forward(benchmark::State& state, const Hexapod* hexapod, bool path) {
  const Workload work = Along(*hexapod, path, 15);
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoses; ++i) {
      const HexapodForward answer = path ? SolveForward(*hexapod, work.lengths[i], work.starts[i])
                                         : SolveForwardFromHome(*hexapod, work.lengths[i]);
      benchmark::DoNotOptimize(answer.platform_pose());
    }
  }
  PerPose(state);
}

void JacobianToParameters(benchmark::State& state) {
  const Workload work = Along(Real(), false, 15);
  for (auto _ : state) {
    for (const Pose& X_MP : work.starts) {
      benchmark::DoNotOptimize(ActuatorParameterJacobian(Real(), X_MP));
    }
  }
  PerPose(state);
}

void SingularValues(benchmark::State& state) {
  const Workload work = Along(Ideal(), false, 15);
  for (auto _ : state) {
    for (const Pose& X_MP : work.starts) {
      benchmark::DoNotOptimize(AnalyseSingularity(Ideal(), X_MP));
    }
  }
  PerPose(state);
}

// Remembers each figure for the table at the end.
class Figures : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type == Run::RT_Aggregate && run.aggregate_name == "median") {
        const auto counter = run.counters.find("ns_per_pose");
        if (counter != run.counters.end()) {
          ns_[run.run_name.function_name] = counter->second.value;
        }
      }
    }
  }
  double operator[](const std::string& name) const {
    const auto found = ns_.find(name);
    return found == ns_.end() ? NAN : found->second;
  }

 private:
  std::map<std::string, double> ns_;
};

void Row(const char* what, double ns, double baseline_ns, const char* baseline, double wanted_ns) {
  std::printf("%-38s %8.1f ns   %s %8.1f ns, ratio %5.2f   wanted %6.0f ns\n", what, ns, baseline,
              baseline_ns, ns / baseline_ns, wanted_ns);
}

}  // namespace
}  // namespace lambdajet::kinematics

int main(int argc, char** argv) {
  using namespace lambdajet::kinematics;
  const auto repeated = [](benchmark::internal::Benchmark* b) {
    b->Repetitions(9)->ReportAggregatesOnly(true)->MinTime(0.05);
  };
  repeated(benchmark::RegisterBenchmark("inverse_plain", InversePlain));
  repeated(benchmark::RegisterBenchmark("inverse_single", InverseSingle));
  repeated(benchmark::RegisterBenchmark("inverse_block", InverseBlock));
  repeated(benchmark::RegisterBenchmark("inverse_nonideal", InverseNonIdeal));
  repeated(benchmark::RegisterBenchmark("forward_plain_path", ForwardPlain, true));
  repeated(benchmark::RegisterBenchmark("forward_plain_home", ForwardPlain, false));
  repeated(benchmark::RegisterBenchmark("forward_path", Forward, &Ideal(), true));
  repeated(benchmark::RegisterBenchmark("forward_home", Forward, &Ideal(), false));
  repeated(benchmark::RegisterBenchmark("forward_nonideal", Forward, &Real(), false));
  repeated(benchmark::RegisterBenchmark("parameter_jacobian", JacobianToParameters));
  repeated(benchmark::RegisterBenchmark("singularity", SingularValues));
  benchmark::Initialize(&argc, argv);
  Figures ns;
  benchmark::RunSpecifiedBenchmarks(&ns);
  std::printf(
      "\nHexapod, one core, medians of 9; beside each the plain statement of the same task in this run\n");
  Row("inverse, one pose", ns["inverse_single"], ns["inverse_plain"], "plain", 60);
  Row("inverse, in blocks", ns["inverse_block"], ns["inverse_plain"], "plain", 10);
  Row("inverse, imperfect joints", ns["inverse_nonideal"], ns["inverse_plain"], "plain ideal", 1500);
  Row("forward, along a path, 15 deg", ns["forward_path"], ns["forward_plain_path"], "plain", 600);
  Row("forward, from home, 15 deg", ns["forward_home"], ns["forward_plain_home"], "plain", 1000);
  Row("forward, imperfect joints, from home", ns["forward_nonideal"], ns["forward_plain_home"], "plain ideal",
      6000);
  std::printf("%-38s %8.1f ns\n%-38s %8.1f ns\n", "Jacobian to 17 parameters a strut",
              ns["parameter_jacobian"], "singular values and weakest motion", ns["singularity"]);
  std::printf(
      "Published for LinuxCNC's genhexkins, another machine: inverse 117 ns; forward 6200 ns along a path, "
      "8600 ns "
      "from home (9 and 12 iterations)\n");
  return 0;
}
