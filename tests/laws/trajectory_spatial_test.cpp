#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "kinematics/core/hexapod_singularity.hpp"
#include "tests/laws/trajectory_spatial_hostile.hpp"
#include "tests/laws/trajectory_spatial_reference.hpp"
#include "trajectory/core/feed/binding.hpp"
#include "trajectory/core/part_program/cldata_writer.hpp"
#include "trajectory/core/part_program/gcode_writer.hpp"
#include "trajectory/core/spatial_feed/play_spatial_plan.hpp"

namespace lambdajet::trajectory {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

PlannedSpatialProgram PlanOf(const std::vector<Operation>& operations,
                             const HexapodMotion& motion = WorkedMotion(),
                             const SpatialOptions& options = {}) {
  return PlanSpatialProgram(operations, "worked", WorkedHexapod(), motion, options);
}

// Struts that are the weakest link.
HexapodMotion LameStruts() {
  HexapodMotion m = WorkedMotion();
  m.strut_velocity_mm_per_s = 90;
  m.strut_acceleration_mm_per_s2 = 900;
  m.strut_jerk_mm_per_s3 = 20000;
  return m;
}

std::string FaultText(const PlannedSpatialProgram& p) {
  return p.faults.empty() ? ""
                          : std::to_string(p.faults[0].line) + " " + std::string(p.faults[0].reason) + " " +
                                p.faults[0].message;
}

Quaterniond RotationOf(const Operation& o) {
  return Quaterniond(Eigen::AngleAxisd(o.c_rad, Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(o.b_rad, Vector3d::UnitY()) *
                     Eigen::AngleAxisd(o.a_rad, Vector3d::UnitX()));
}

// A programmed block as the words say it: the tip by its share of the way, the rotation by the sphere's great circle.
struct Block {
  Operation from, to;
  double tolerance_mm = 0.0;
  Vector3d TipAt(double u) const {
    const Vector3d a(from.x_W_mm, from.y_W_mm, from.z_W_mm), b(to.x_W_mm, to.y_W_mm, to.z_W_mm);
    if (to.kind != OperationKind::kFeedArc) {
      return a + u * (b - a);
    }
    const int n = to.plane == ArcPlane::kXy ? 2 : to.plane == ArcPlane::kZx ? 1 : 0;
    Vector3d centre(to.center_x_W_mm, to.center_y_W_mm, to.center_z_W_mm);
    centre[n] = a[n];
    const Vector3d out = a - centre, side = Vector3d::Unit(n).cross(out);
    Vector3d p = centre + std::cos(u * to.sweep_rad) * out + std::sin(u * to.sweep_rad) * side;
    p[n] = a[n] + u * (b[n] - a[n]);
    return p;
  }
  Quaterniond TurnAt(double u) const { return RotationOf(from).slerp(u, RotationOf(to)); }
  // Larger of both shares of tolerance.
  double Ratio(double u, const Vector3d& p, const Quaterniond& q) const {
    return std::max((p - TipAt(u)).norm() / tolerance_mm,
                    q.angularDistance(TurnAt(u)) / WorkedMotion().corner_tolerance_rad);
  }
  double Nearest(const Vector3d& p, const Quaterniond& q) const {
    double best = 1e9, at = 0.0;
    const int kCoarse = to.kind == OperationKind::kFeedArc ? 40 : 10;
    for (int i = 0; i <= kCoarse; ++i) {
      const double ratio = Ratio(i / static_cast<double>(kCoarse), p, q);
      if (ratio < best) {
        best = ratio, at = i / static_cast<double>(kCoarse);
      }
    }
    double a = std::max(0.0, at - 1.0 / kCoarse), b = std::min(1.0, at + 1.0 / kCoarse);
    for (int i = 0; i < 34; ++i) {
      const double c = a + 0.382 * (b - a), d = a + 0.618 * (b - a);
      (Ratio(c, p, q) < Ratio(d, p, q) ? b : a) = Ratio(c, p, q) < Ratio(d, p, q) ? d : c;
    }
    return std::min(best, Ratio(0.5 * (a + b), p, q));
  }
};

std::vector<Block> BlocksOf(const std::vector<Operation>& operations) {
  std::vector<Block> blocks;
  const Operation* last = nullptr;
  double tolerance = WorkedMotion().corner_tolerance_mm;
  for (const Operation& o : operations) {
    if (o.kind == OperationKind::kPathTolerance) {
      tolerance = o.value;
    } else if (o.kind <= OperationKind::kFeedArc) {
      if (last != nullptr) {
        blocks.push_back({*last, o, tolerance > 0.0 ? tolerance : WorkedMotion().corner_tolerance_mm});
      }
      last = &o;
    }
  }
  return blocks;
}

struct Worst {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0, path_acceleration = 0.0, ratio = 0.0;
  double forward_mm = 0.0, forward_rad = 0.0;
};

void SampleLimits(const SpatialPlan& plan, const HexapodMotion& m, Worst& worst) {
  for (const SpatialSegment& s : plan.segments) {
    for (double t = 0.0; t <= s.duration_s; t += 1e-4) {
      for (const Polynomial& q : s.q_mm) {
        worst.velocity = std::max(worst.velocity, std::abs(q.first(t)) / m.strut_velocity_mm_per_s);
        worst.acceleration =
            std::max(worst.acceleration, std::abs(q.second(t)) / m.strut_acceleration_mm_per_s2);
        worst.jerk = std::max(worst.jerk, std::abs(q.third(t)) / m.strut_jerk_mm_per_s3);
      }
    }
  }
}

// Plays the struts through the forward kinematics; path acceleration, way back to the planned pose, and tolerance.
void PlayForward(const PlannedSpatialProgram& planned, const std::vector<Block>& blocks, double step_s,
                 Worst& worst, const HexapodGeometry& geometry = WorkedHexapod()) {
  const StrutMotion machine(geometry, WorkedMotion().X_MT_zero);
  Pose X_MP = machine.PlatformAt(planned.samples.front().p_W_mm, planned.samples.front().q_W);
  std::size_t at = 0;
  for (double tau = 0.0; tau < planned.plan.duration_s; tau += step_s) {
    const StrutState struts = StrutsAt(planned.plan, tau);
    const kinematics::HexapodForward forward = kinematics::SolveForward(machine.hexapod(), struts.q_mm, X_MP);
    ASSERT_EQ(forward.reason, kinematics::Reason::kSolved) << "at " << tau;
    X_MP = forward.X_MP;
    const kinematics::PlatformMotion motion =
        kinematics::PlatformMotionOf(machine.hexapod(), X_MP, {struts.first, struts.second});
    const Vector3d lever = X_MP.R * machine.hexapod().geometry().X_PT.p_mm;
    const TwistRate rate = AtLever(motion.twist, motion.rate, lever);
    worst.path_acceleration = std::max(
        worst.path_acceleration,
        std::hypot(rate.a_mm_per_s2.norm(), planned.plan.turn_radius_mm * rate.alpha_rad_per_s2.norm()) /
            WorkedMotion().path_acceleration_mm_per_s2);
    const Pose tool = machine.ToolAt(X_MP);
    const Quaterniond q(tool.R);
    double nearest = 1e9;
    for (std::size_t i = at; i < std::min(at + 40, blocks.size()) && nearest > 0.02; ++i) {
      const double ratio = blocks[i].Nearest(tool.p_mm, q);
      if (ratio < nearest) {
        nearest = ratio;
        if (ratio < 1.0 && i > at + 4) {
          at = i - 4;
        }
      }
    }
    for (std::size_t i = 0; i < blocks.size() && nearest > 1.0;
         ++i) {  // a place that is visited again led astray
      nearest = std::min(nearest, blocks[i].Nearest(tool.p_mm, q));
    }
    worst.ratio = std::max(worst.ratio, nearest);
  }
  for (const SpatialPlanSample& sample : planned.samples) {
    if (sample.tau_s < planned.plan.duration_s) {
      const Pose start = machine.PlatformAt(sample.p_W_mm, sample.q_W);
      const Pose tool = machine.ToolAt(
          kinematics::SolveForward(machine.hexapod(), StrutsAt(planned.plan, sample.tau_s).q_mm, start).X_MP);
      worst.forward_mm = std::max(worst.forward_mm, (tool.p_mm - sample.p_W_mm).norm());
      worst.forward_rad = std::max(worst.forward_rad, Quaterniond(tool.R).angularDistance(sample.q_W));
    }
  }
}

TEST(SpatialPlan, KeepsEveryLimitAndBothTolerancesOnRandomPrograms) {
  Worst worst;
  double duration = 0.0;
  int planned_count = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const std::vector<Operation> operations = RandomSpatialProgram(seed).Draw(12);
    const HexapodMotion motion = seed % 2 == 0 ? LameStruts() : WorkedMotion();
    const PlannedSpatialProgram planned = PlanOf(operations, motion);
    ASSERT_TRUE(planned.faults.empty()) << "seed " << seed << ": " << FaultText(planned);
    SampleLimits(planned.plan, motion, worst);
    PlayForward(planned, BlocksOf(operations), 0.01, worst);
    duration += planned.plan.duration_s;
    ++planned_count;
  }
  std::printf(
      "%d programs, %.0f s: of their limits velocity %.6f acceleration %.6f jerk %.6f path acceleration "
      "%.6f, of "
      "tolerance %.4f; forward from struts %.1e mm %.1e rad\n",
      planned_count, duration, worst.velocity, worst.acceleration, worst.jerk, worst.path_acceleration,
      worst.ratio, worst.forward_mm, worst.forward_rad);
  EXPECT_LE(worst.velocity, 1.0 + 1e-6);
  EXPECT_LE(worst.acceleration, 1.0 + 1e-6);
  EXPECT_LE(worst.jerk, 1.0 + 1e-6);
  EXPECT_LE(worst.path_acceleration, 1.0 + 1e-6);
  EXPECT_LE(worst.ratio, 1.0);
  EXPECT_LE(worst.forward_mm, 1e-3);
  EXPECT_LE(worst.forward_rad, 1e-5);
}

// LAMBDAJET_RANDOM_PROGRAMS: how many hostile programs of every kind, or FIRST-LAST; more of them than CI's slice are larger, too.
struct HostileSeeds {
  std::uint64_t first = 1, last = 3;
  int size = 5;
};

HostileSeeds WantedHostileSeeds() {
  HostileSeeds seeds;
  if (const char* wanted = std::getenv("LAMBDAJET_RANDOM_PROGRAMS"); wanted != nullptr) {
    unsigned first = 0, last = 0;
    const int numbers = std::sscanf(wanted, "%u-%u", &first, &last);
    seeds = numbers == 2 ? HostileSeeds{first, last, 12} : HostileSeeds{1, first, 12};
  }
  return seeds;
}

// Of the machine with its limits tighter by as much as a plan may leave the programmed poses.
HexapodGeometry Tightened(HexapodGeometry g) {
  g.limits.strut_min_mm += 0.2, g.limits.strut_max_mm -= 0.2;
  g.limits.base_cone_rad -= 2e-3, g.limits.platform_cone_rad -= 2e-3;
  g.limits.singular_margin += 2e-3;
  return g;
}

// The first line whose programmed poses the machine cannot hold; 0: it can hold all.
std::uint32_t FirstLineOutOfReach(const std::vector<Operation>& operations, const HexapodGeometry& geometry) {
  const StrutMotion machine(geometry, WorkedMotion().X_MT_zero);
  for (const Block& block : BlocksOf(operations)) {
    constexpr int kChecks = 300;
    for (int i = 0; i <= kChecks; ++i) {
      const double u = i / static_cast<double>(kChecks);
      ProgramFault fault;
      if (!machine.Reaches(block.TipAt(u), block.TurnAt(u), block.to.line, fault)) {
        return block.to.line;
      }
    }
  }
  return 0;
}

void ExpectHeld(const PlannedSpatialProgram& planned, const std::vector<Operation>& operations,
                const HexapodMotion& motion, const HexapodGeometry& geometry, Worst& worst) {
  Worst own;
  SampleLimits(planned.plan, motion, own);
  PlayForward(planned, BlocksOf(operations), std::max(0.01, planned.plan.duration_s / 4000.0), own, geometry);
  EXPECT_LE(own.velocity, 1.0 + 1e-6);
  EXPECT_LE(own.acceleration, 1.0 + 1e-6);
  EXPECT_LE(own.jerk, 1.0 + 1e-6);
  EXPECT_LE(own.path_acceleration, 1.0 + 1e-6);
  EXPECT_LE(own.ratio, 1.0);
  for (double Worst::*share :
       {&Worst::velocity, &Worst::acceleration, &Worst::jerk, &Worst::path_acceleration, &Worst::ratio}) {
    worst.*share = std::max(worst.*share, own.*share);
  }
}

// What lies in reach gets a plan that holds every limit; what does not is refused with the line and the place.
TEST(SpatialPlan, HostileProgramsAreHeldOrRefusedByLineAndPlace) {
  const HostileSeeds seeds = WantedHostileSeeds();
  int all_refused = 0;
  for (std::size_t kind = 0; kind < kHostileNames.size(); ++kind) {
    Worst worst;
    int held = 0, refused = 0;
    double moving_s = 0.0;
    for (std::uint64_t seed = seeds.first; seed <= seeds.last; ++seed) {
      SCOPED_TRACE(std::string(kHostileNames[kind]) + ", seed " + std::to_string(seed));
      HostileSpatialProgram program(static_cast<Hostile>(kind), seed);
      const std::vector<Operation> operations =
          program.Draw(static_cast<Hostile>(kind) == Hostile::kOneBlock ? 1 : seeds.size);
      const HexapodGeometry geometry = program.geometry();
      const HexapodMotion motion = seed % 2 == 0 ? LameStruts() : WorkedMotion();
      const PlannedSpatialProgram planned = PlanSpatialProgram(operations, "worked", geometry, motion, {});
      const std::uint32_t line = FirstLineOutOfReach(operations, geometry);
      if (planned.faults.empty()) {
        EXPECT_EQ(line, 0u) << "is planned through what cannot be held";
        ExpectHeld(planned, operations, motion, geometry, worst);
        moving_s += planned.plan.duration_s;
        ++held;
      } else {
        EXPECT_NE(FirstLineOutOfReach(operations, Tightened(geometry)), 0u) << FaultText(planned);
        EXPECT_TRUE(planned.plan.segments.empty());
        EXPECT_TRUE(line == 0 || planned.faults[0].line == line) << line << ": " << FaultText(planned);
        EXPECT_THAT(planned.faults[0].message, testing::HasSubstr("cannot hold the tool at X"));
        EXPECT_THAT(std::string(planned.faults[0].reason),
                    testing::AnyOf("ACTUATOR_LIMIT", "JOINT_LIMIT", "SINGULAR", "OUT_OF_REACH"));
        ++refused;
      }
    }
    std::printf("%s: %d held (%.0f s), %d refused; of limits %.6f %.6f %.6f, path %.6f, of tolerance %.4f\n",
                kHostileNames[kind], held, moving_s, refused, worst.velocity, worst.acceleration, worst.jerk,
                worst.path_acceleration, worst.ratio);
    std::fflush(stdout);
    EXPECT_GT(held, 0) << kHostileNames[kind];
    all_refused += refused;
  }
  EXPECT_GT(all_refused, 0);
}

// A cut whose ends can both be held by wide joints turns the platform through its singular place.
TEST(SpatialPlan, ASingularPlaceWithinACutIsRefusedThere) {
  HexapodGeometry wide = WideHexapod();
  const std::vector<Operation> operations = {
      SpatialMove(OperationKind::kTraverse, {0, 0, 20}, {0, 0, 0}, 0, 3),
      SpatialMove(OperationKind::kFeedLine, {20, 0, 20}, {0, 0, 0.2}, 50, 4),
      SpatialMove(OperationKind::kFeedLine, {20, 10, 20}, {0, 0, 1.9}, 50, 5),
      SpatialMove(OperationKind::kFeedLine, {0, 10, 20}, {0, 0, 1.9}, 50, 6)};
  for (const double margin : {0.15, 0.0}) {
    SCOPED_TRACE(margin);
    wide.limits.singular_margin = margin;
    const PlannedSpatialProgram planned = PlanSpatialProgram(operations, "wide", wide, WorkedMotion(), {});
    ASSERT_FALSE(planned.faults.empty());
    EXPECT_TRUE(planned.plan.segments.empty());
    EXPECT_EQ(planned.faults[0].line, 5u);
    EXPECT_EQ(planned.faults[0].reason, "SINGULAR");
    EXPECT_THAT(planned.faults[0].message, testing::HasSubstr("SINGULAR_MARGIN"));
    // The place, to a node: where the margin of the poses along the block runs out.
    const StrutMotion machine(wide, WorkedMotion().X_MT_zero);
    const Block block{operations[1], operations[2], 0.02};
    double in = 0.0, out = 1.0;
    for (int i = 0; i < 50; ++i) {
      const double u = 0.5 * (in + out);
      const double left = kinematics::AnalyseSingularity(machine.hexapod(),
                                                         machine.PlatformAt(block.TipAt(u), block.TurnAt(u)))
                              .signed_margin -
                          margin;
      (left > 0.0 ? in : out) = u;
    }
    double y = 0.0, c = 0.0;
    const char* at = std::strstr(planned.faults[0].message.c_str(), " Y");
    ASSERT_NE(at, nullptr);
    ASSERT_EQ(std::sscanf(at, " Y%lf", &y), 1);
    at = std::strstr(at, " C");
    ASSERT_EQ(std::sscanf(at, " C%lf", &c), 1);
    EXPECT_NEAR(y, 10.0 * in, 0.05);
    EXPECT_NEAR(c, (0.2 + 1.7 * in) * 180.0 / std::numbers::pi, 0.4);
  }
}

// No machine cuts for as long as this feed asks, and no plan that long is laid out.
TEST(SpatialPlan, AFeedThatNeverEndsIsRefusedAtItsLine) {
  const std::vector<Operation> slow = {
      SpatialMove(OperationKind::kTraverse, {-50, 0, 20}, {0, 0, 0}, 0, 1),
      SpatialMove(OperationKind::kFeedLine, {50, 0, 20}, {0, 0, 0}, 50, 2),
      SpatialMove(OperationKind::kFeedLine, {50, 40, 20}, {0, 0, 0}, 1e-4, 3),
      SpatialMove(OperationKind::kFeedLine, {0, 40, 20}, {0, 0, 0}, 50, 4)};
  const PlannedSpatialProgram planned = PlanOf(slow);
  ASSERT_EQ(planned.faults.size(), 1u);
  EXPECT_EQ(planned.faults[0].line, 3u);
  EXPECT_EQ(planned.faults[0].reason, "PLAN_TOO_LONG");
  EXPECT_TRUE(planned.plan.segments.empty());
  Operation helix = SpatialMove(OperationKind::kFeedArc, {10, 0, 20}, {0, 0, 0}, 20, 2);
  helix.sweep_rad = 1e6;
  EXPECT_EQ(PlanOf({SpatialMove(OperationKind::kTraverse, {10, 0, 20}, {0, 0, 0}, 0, 1), helix})
                .faults.at(0)
                .reason,
            "PLAN_TOO_LONG");
}

// The plain reference on every block, with the limits themselves; every corner exact, jerk without limit.
TEST(SpatialPlan, LastsNearlyTheTimeOptimalBoundWithJerkInactive) {
  for (const HexapodMotion& limits : {WorkedMotion(), LameStruts()}) {
    HexapodMotion motion = limits;
    motion.path_jerk_mm_per_s3 = 1e9;
    motion.strut_jerk_mm_per_s3 = 1e12;
    std::vector<Operation> operations = {
        SpatialMove(OperationKind::kTraverse, {-80, -60, 20}, {0, 0, 0}, 0, 1)};
    Operation exact;
    exact.kind = OperationKind::kPathTolerance;
    operations.push_back(exact);
    operations.push_back(SpatialMove(OperationKind::kFeedLine, {80, 60, 20}, {0.2, -0.1, 0.1}, 120, 2));
    operations.push_back(SpatialMove(OperationKind::kTraverse, {-80, 70, 50}, {-0.2, 0.2, -0.2}, 0, 3));
    operations.push_back(SpatialMove(OperationKind::kFeedLine, {90, 0, 10}, {0.1, -0.2, 0.2}, 150, 4));
    Operation arc = SpatialMove(OperationKind::kFeedArc, {-90, 0, 30}, {0, 0.2, 0}, 100, 5);
    arc.sweep_rad = std::numbers::pi;
    operations.push_back(arc);
    operations.push_back(SpatialMove(OperationKind::kTraverse, {60, -80, 60}, {0.15, 0.1, 0.3}, 0, 6));
    SpatialOptions options;
    options.knot_s = 0.00025;
    const PlannedSpatialProgram planned = PlanOf(operations, motion, options);
    ASSERT_TRUE(planned.faults.empty()) << FaultText(planned);
    const StrutMotion struts(WorkedHexapod(), motion.X_MT_zero);
    ActuatorBoundsOf<6> bounds;
    bounds.velocity_mm_per_s.fill(motion.strut_velocity_mm_per_s);
    bounds.acceleration_mm_per_s2.fill(motion.strut_acceleration_mm_per_s2);
    double bound = 0.0;
    for (const SpatialRun& run : MakeSpatialPath(operations, motion, struts.hexapod().lever_mm(), 1.0).runs) {
      constexpr int kCells = 4000;
      const SpatialPiece& piece = run.pieces.at(0);
      std::vector<ProfileNodeOf<6>> nodes(kCells + 1);
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const double offset = piece.length_mm * static_cast<double>(i) / kCells;
        const SpatialPoint at = PointOn(piece, offset);
        const StrutState state =
            struts.At({at.p_mm, at.q, {at.tangent, at.turn}, {at.bend, Vector3d::Zero()}});
        nodes[i].offset_mm = offset;
        nodes[i].speed_cap_mm_per_s = piece.feed_mm_per_s;
        nodes[i].curvature = at.bend.norm();
        nodes[i].acceleration_mm_per_s2 = motion.path_acceleration_mm_per_s2;
        Eigen::Map<StrutVector>(nodes[i].A.data()) = state.first;
        Eigen::Map<StrutVector>(nodes[i].B.data()) = state.second;
      }
      bound += ReferenceDuration(nodes, bounds);
    }
    std::printf("jerk inactive: %.4f s, time-optimal bound %.4f s, ratio %.4f\n", planned.plan.duration_s,
                bound, planned.plan.duration_s / bound);
    EXPECT_LE(planned.plan.duration_s, 1.03 * bound);
    EXPECT_GE(planned.plan.duration_s, bound);
  }
}

TEST(SpatialPlan, TimingOfSixActuatorsIsThatOfThePlainReference) {
  std::mt19937_64 random(3);
  double worst = 0.0;
  for (int i = 0; i < 6; ++i) {
    const TimedPath<6> path = TimedPath<6>::Random(random, 400.0);
    std::vector<ProfileNodeOf<6>> nodes = path.Nodes(8000);
    SolveSpeedProfile(nodes, path.bounds, 0.0, 0.0);
    worst = std::max(
        worst, std::abs(ProfileDuration(nodes) / ReferenceDuration(path.Nodes(40000), path.bounds) - 1.0));
    for (const ProfileNodeOf<6>& node : nodes) {
      const AccelerationInterval u = Allowed(node, path.bounds, node.x * (1 - 1e-12));
      ASSERT_LE(u.from, u.to + 1e-6);
    }
  }
  EXPECT_LE(worst, 1e-4);
}

std::vector<Operation> MovesOf(const std::vector<Operation>& operations) {
  std::vector<Operation> moves;
  std::copy_if(operations.begin(), operations.end(), std::back_inserter(moves),
               [](const Operation& o) { return o.kind <= OperationKind::kFeedArc; });
  return moves;
}

TEST(SpatialPlan, LastsAsLongBackwards) {
  double worst = 0.0;
  for (std::uint64_t seed = 21; seed <= 26; ++seed) {
    const std::vector<Operation> there = MovesOf(RandomSpatialProgram(seed).Draw(8));
    std::vector<Operation> back = {there.back()};
    back[0].kind = OperationKind::kTraverse;
    for (std::size_t i = there.size() - 1; i > 0; --i) {
      Operation o = there[i];
      o.x_W_mm = there[i - 1].x_W_mm, o.y_W_mm = there[i - 1].y_W_mm, o.z_W_mm = there[i - 1].z_W_mm;
      o.a_rad = there[i - 1].a_rad, o.b_rad = there[i - 1].b_rad, o.c_rad = there[i - 1].c_rad;
      o.sweep_rad = -o.sweep_rad;
      back.push_back(o);
    }
    const PlannedSpatialProgram forth = PlanOf(there), reversed = PlanOf(back);
    ASSERT_TRUE(forth.faults.empty() && reversed.faults.empty()) << FaultText(forth) << FaultText(reversed);
    EXPECT_NEAR(forth.plan.length_mm, reversed.plan.length_mm, 1e-6);
    worst = std::max(worst, std::abs(forth.plan.duration_s / reversed.plan.duration_s - 1.0));
  }
  std::printf("backwards: durations differ by at most %.1e\n", worst);
  EXPECT_LE(worst, 5e-3);
}

// Slowing is repeated until every limit holds, which may turn rounding into another pass: only a plan that needs little of it
// is the same to the last digits.
TEST(SpatialPlan, TurnsWithTheMachineBy120Degrees) {
  const Eigen::Matrix3d R = RotationZ(2.0 * std::numbers::pi / 3.0);
  for (std::uint64_t seed = 31; seed <= 34; ++seed) {
    const std::vector<Operation> here = RandomSpatialProgram(seed, true).Draw(8);
    std::vector<Operation> there = here;
    for (Operation& o : there) {
      const Vector3d p = R * Vector3d(o.x_W_mm, o.y_W_mm, o.z_W_mm);
      const Vector3d c = R * Vector3d(o.center_x_W_mm, o.center_y_W_mm, o.center_z_W_mm);
      o.x_W_mm = p.x(), o.y_W_mm = p.y();
      o.center_x_W_mm = c.x(), o.center_y_W_mm = c.y();
    }
    const PlannedSpatialProgram a = PlanOf(here), b = PlanOf(there);
    ASSERT_TRUE(a.faults.empty() && b.faults.empty()) << FaultText(a) << FaultText(b);
    ASSERT_EQ(a.plan.segments.size(), b.plan.segments.size()) << "seed " << seed;
    for (double tau = 0.0; tau < a.plan.duration_s; tau += 0.05) {
      const StrutVector q = StrutsAt(a.plan, tau).q_mm, turned = StrutsAt(b.plan, tau).q_mm;
      for (int j = 0; j < kStruts; ++j) {
        ASSERT_NEAR(q[j], turned[(j + 4) % kStruts], 1e-6)
            << "seed " << seed << " strut " << j + 1 << " at " << tau;
      }
    }
    const double lame =
        PlanOf(here, LameStruts()).plan.duration_s / PlanOf(there, LameStruts()).plan.duration_s;
    EXPECT_NEAR(lame, 1.0, 0.02) << "seed " << seed;
  }
}

TEST(SpatialPlan, RefusesWithTheLine) {
  const auto reason_of = [](const Vector3d& p, const Vector3d& abc) {
    const PlannedSpatialProgram planned =
        PlanOf({SpatialMove(OperationKind::kTraverse, {0, 0, 20}, {0, 0, 0}, 0, 1),
                SpatialMove(OperationKind::kFeedLine, {10, 0, 20}, {0, 0, 0}, 50, 2),
                SpatialMove(OperationKind::kFeedLine, p, abc, 50, 7)});
    EXPECT_TRUE(planned.plan.segments.empty());
    EXPECT_EQ(planned.faults.size(), 1u);
    return planned.faults.empty()
               ? std::string()
               : std::to_string(planned.faults[0].line) + " " + std::string(planned.faults[0].reason) + " " +
                     planned.faults[0].message;
  };
  EXPECT_THAT(reason_of({500, 0, 20}, {0, 0, 0}), testing::HasSubstr("beyond STRUT_M"));
  EXPECT_THAT(reason_of({0, 0, 20}, {0, 0, 1.2}), testing::HasSubstr("JOINT_CONE"));
  EXPECT_THAT(reason_of({0, 0, 20}, {0, 0, 3.1}), testing::StartsWith("7 TURN_TOO_LARGE"));
  EXPECT_THAT(reason_of({500, 0, 20}, {0, 0, 0}), testing::StartsWith("7 "));
}

TEST(DrillingCycle, PecksAsLinuxCncDoesAtNoTilt) {
  DrilledHole hole;
  hole.entry_W_mm = {10, 20, 0};
  hole.retract_mm = 2, hole.bottom_mm = -10, hole.clear_mm = 15, hole.peck_mm = 4, hole.dwell_s = 0.5;
  std::vector<Operation> moves;
  AppendDrilledHole(hole, moves);
  std::vector<double> heights;
  for (const Operation& o : moves) {
    heights.push_back(o.kind == OperationKind::kDwell ? 99.0 : o.z_W_mm);
    EXPECT_TRUE(o.kind == OperationKind::kDwell || (o.x_W_mm == 10 && o.y_W_mm == 20));
  }
  EXPECT_THAT(heights, testing::Pointwise(testing::DoubleNear(1e-12), {15.0, 2.0, -2.0, 2.0, -1.746, -6.0,
                                                                       2.0, -5.746, -10.0, 99.0, 15.0}));
}

TEST(DrillingCycle, FeedsAlongTheTiltedAxisAndDwellsAtItsBottom) {
  DrilledHole hole;
  hole.entry_W_mm = {30, -20, 0};
  hole.a_rad = 0.25, hole.b_rad = -0.2;
  hole.retract_mm = hole.clear_mm = 3, hole.bottom_mm = -12, hole.dwell_s = 0.3, hole.feed_mm_per_s = 10;
  std::vector<Operation> operations = {SpatialMove(OperationKind::kTraverse, {0, 0, 30}, {0, 0, 0}, 0, 1)};
  AppendDrilledHole(hole, operations);
  const PlannedSpatialProgram planned = PlanOf(operations);
  ASSERT_TRUE(planned.faults.empty()) << FaultText(planned);
  ASSERT_EQ(planned.plan.gates.size(), 1u);
  EXPECT_EQ(planned.plan.gates[0].kind, GateKind::kDwell);
  EXPECT_EQ(planned.gate_time_s, 0.3);
  // What the rotary words mean, written out: the axis is Ry(B) Rx(A) z.
  const double a = hole.a_rad, b = hole.b_rad;
  const Vector3d axis(std::cos(a) * std::sin(b), -std::sin(a), std::cos(a) * std::cos(b));
  double deepest = 0.0;
  for (const SpatialPlanSample& s : planned.samples) {
    const double height = axis.dot(s.p_W_mm - hole.entry_W_mm);
    deepest = std::min(deepest, height);
    if (height < 0.0) {
      EXPECT_LE((s.p_W_mm - hole.entry_W_mm - height * axis).norm(), 1e-6);
      EXPECT_LE((s.q_W * Vector3d::UnitZ() - axis).norm(), 1e-9);
      EXPECT_LE(s.tip_speed_mm_per_s, s.cutting ? 10.0 * 1.001 : 400.0);
    }
  }
  EXPECT_NEAR(deepest, -12.0, 1e-9);
}

HexapodModel WorkedModel() { return {"worked", "0123456789ab", WorkedHexapod(), WorkedMotion()}; }

std::string ShippedHoles(const char* notation = "ngc") {
  const char* folder = std::getenv("LAMBDAJET_SOURCE_DIR");
  std::ifstream file(std::string(folder) + "/deploy/parts/tilted_holes/tilted_holes." + notation);
  return {std::istreambuf_iterator<char>(file), {}};
}

// The shipped program: its cycles, read as G-code writes them, drill along the tool, and the whole of it can be planned.
TEST(DrillingCycle, OfTheShippedProgramFollowTheToolsTilt) {
  const PartProgram program = ReadSpatialProgram(ShippedHoles(), WorkedMotion());
  ASSERT_TRUE(program.faults.empty()) << program.faults[0].message;
  int bottoms = 0;
  for (std::size_t i = 1; i < program.operations.size(); ++i) {
    const Operation& above = program.operations[i - 1];
    const Operation& at = program.operations[i];
    if (at.kind != OperationKind::kFeedLine || above.kind != OperationKind::kTraverse || at.line > 29) {
      continue;
    }
    const Vector3d way(at.x_W_mm - above.x_W_mm, at.y_W_mm - above.y_W_mm, at.z_W_mm - above.z_W_mm);
    EXPECT_LE((way.normalized() + RotationOf(at) * Vector3d::UnitZ()).norm(), 1e-9) << "line " << at.line;
    ++bottoms;
  }
  EXPECT_GE(bottoms, 9);
  const PlannedSpatialProgram planned = PlanOf(program.operations);
  EXPECT_TRUE(planned.faults.empty()) << FaultText(planned);
}

// A plan of the program as it stands, and of the same program written as CLDATA and read again: how far apart the struts are, 0
// where durations differ.
double ApartFromCldata(const std::vector<Operation>& operations, double& worst_ratio) {
  const CldataText written = WriteCldata(operations, "part", {}, ToolAngles::kRollPitch);
  EXPECT_TRUE(written.faults.empty()) << written.faults[0].message;
  const PartProgram read = ReadSpatialProgram(written.text, WorkedMotion());
  EXPECT_TRUE(read.faults.empty()) << read.faults[0].line << " " << read.faults[0].message;
  EXPECT_EQ(WriteCldata(read.operations, "part", {}, ToolAngles::kRollPitch).text, written.text);
  const PlannedSpatialProgram a = PlanOf(operations), b = PlanOf(read.operations);
  EXPECT_TRUE(a.faults.empty() && b.faults.empty()) << FaultText(a) << FaultText(b);
  EXPECT_EQ(a.plan.gates.size(), b.plan.gates.size());
  EXPECT_NEAR(a.plan.length_mm, b.plan.length_mm, 1e-6);
  const double ratio = std::abs(a.plan.duration_s / b.plan.duration_s - 1.0);
  worst_ratio = std::max(worst_ratio, ratio);
  double apart_mm = 0.0;
  for (double tau = 0.0; tau < a.plan.duration_s && ratio < 1e-9; tau += 0.01) {
    const StrutVector apart = StrutsAt(a.plan, tau).q_mm - StrutsAt(b.plan, tau).q_mm;
    apart_mm = std::max(apart_mm, apart.cwiseAbs().maxCoeff());
  }
  return apart_mm;
}

// Rounding may be judged by a pass more or less; such a plan lasts nearly as long, and most are the same.
TEST(SpatialCldata, GivesThePlanOfTheSameProgramInGcode) {
  double worst_ratio = 0.0;
  const double shipped_mm =
      ApartFromCldata(ReadSpatialProgram(ShippedHoles(), WorkedMotion()).operations, worst_ratio);
  std::printf("shipped holes: struts apart %.1e mm, durations %.1e\n", shipped_mm, worst_ratio);
  EXPECT_LE(shipped_mm, 1e-6);
  EXPECT_LE(worst_ratio, 1e-9);
  double worst_mm = 0.0;
  int same = 0;
  for (std::uint64_t seed = 41; seed <= 46; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<Operation> operations = RandomSpatialProgram(seed).Draw(10);
    for (Operation& o : operations) {
      o.c_rad = 0.0;  // an axis cannot say it
    }
    operations.emplace_back();  // the end
    const double apart_mm = ApartFromCldata(operations, worst_ratio);
    worst_mm = std::max(worst_mm, apart_mm);
    same += apart_mm <= 1e-5 ? 1 : 0;
  }
  std::printf("and random ones: %d of 6 the same to 1e-5 mm, worst %.1e mm, durations %.1e\n", same, worst_mm,
              worst_ratio);
  EXPECT_GE(same, 4);
  EXPECT_LE(worst_mm, 1e-2);
  EXPECT_LE(worst_ratio, 5e-3);
}

// The shipped holes as a CAM system writes them: CYCLE with MULTAX, the spindle and its coolant.
TEST(SpatialCldata, ItsCyclesGiveThePlanOfTheSameHolesInGcode) {
  const PartProgram gcode = ReadSpatialProgram(ShippedHoles(), WorkedMotion());
  const PartProgram cldata = ReadSpatialProgram(ShippedHoles("cldata"), WorkedMotion());
  ASSERT_TRUE(gcode.faults.empty() && cldata.faults.empty());
  const PlannedSpatialProgram a = PlanOf(gcode.operations), b = PlanOf(cldata.operations);
  ASSERT_TRUE(a.faults.empty() && b.faults.empty()) << FaultText(a) << FaultText(b);
  EXPECT_NEAR(a.plan.length_mm, b.plan.length_mm, 1e-5);
  EXPECT_NEAR(a.gate_time_s, b.gate_time_s, 1e-12);
  std::printf("holes as G-code and as CYCLE: %.6f and %.6f s, %.6f and %.6f mm\n", a.plan.duration_s,
              b.plan.duration_s, a.plan.length_mm, b.plan.length_mm);
  EXPECT_NEAR(a.plan.duration_s / b.plan.duration_s, 1.0,
              1e-3);  // nine digits of an axis may be a pass more or less
  ASSERT_EQ(a.plan.events.size(), b.plan.events.size());
  for (std::size_t i = 0; i < a.plan.events.size(); ++i) {
    EXPECT_EQ(a.plan.events[i].action, b.plan.events[i].action);
    EXPECT_EQ(a.plan.events[i].argument, b.plan.events[i].argument);
    EXPECT_NEAR(a.plan.events[i].s_mm, b.plan.events[i].s_mm, 1e-5);
  }
}

// The machine stands still while the spindle runs up, for its share of the description's time; nobody waits for its stop.
TEST(SpatialSpindle, IsWaitedForWhereItsSpeedChanges) {
  const std::string text =
      "S6000 M3\nG0 X0 Y0 Z20\nM8\nG1 X10 F600\nS12000\nG1 X20\nM4 S3000\nM9\nG1 X30\nM5\nG1 X40\nM2\n";
  const PartProgram program = ReadSpatialProgram(text, WorkedMotion());
  ASSERT_TRUE(program.faults.empty()) << program.faults[0].message;
  const PlannedSpatialProgram planned = PlanOf(program.operations);
  ASSERT_TRUE(planned.faults.empty()) << FaultText(planned);
  std::vector<double> waits, gate_mm, said;
  for (const Gate& gate : planned.plan.gates) {
    EXPECT_EQ(gate.kind, GateKind::kDwell);
    waits.push_back(gate.argument);
    gate_mm.push_back(gate.s_mm);
  }
  for (const SpatialProcessEvent& event : planned.plan.events) {
    said.push_back(event.action == SpatialAction::kSpindle     ? event.argument
                   : event.action == SpatialAction::kCoolantOn ? 1.0
                                                               : -1.0);
  }
  EXPECT_THAT(waits, testing::Pointwise(testing::DoubleNear(1e-12), {0.75, 0.75, 1.875, 0.0}));
  EXPECT_THAT(gate_mm, testing::Pointwise(testing::DoubleNear(1e-9), {0.0, 10.0, 20.0, 30.0}));
  EXPECT_THAT(said,
              testing::Pointwise(testing::DoubleNear(1e-12), {6000.0, 1.0, 12000.0, -3000.0, -1.0, 0.0}));
  EXPECT_NEAR(planned.gate_time_s, 3.375, 1e-12);
  // Written out in both notations it is the same program.
  const std::string gcode = WriteGcode(program.operations, "spindle");
  const CldataText cldata = WriteCldata(program.operations, "spindle", {}, ToolAngles::kRollPitch);
  for (const std::string& written : {gcode, cldata.text}) {
    const PartProgram again = ReadSpatialProgram(written, WorkedMotion());
    ASSERT_TRUE(again.faults.empty()) << written << again.faults[0].message;
    const PlannedSpatialProgram same = PlanOf(again.operations);
    EXPECT_EQ(same.gate_time_s, planned.gate_time_s) << written;
    EXPECT_EQ(same.plan.events.size(), planned.plan.events.size());
    EXPECT_NEAR(same.plan.duration_s, planned.plan.duration_s, 1e-9);
  }
  HexapodMotion without = WorkedMotion();
  without.spindle_most_per_min = 0.0;
  EXPECT_EQ(ReadSpatialProgram(text, without).faults.at(0).reason, "SPINDLE_MISSING");
  EXPECT_EQ(ReadSpatialProgram("S400 M3\nM2\n", WorkedMotion()).faults.at(0).reason,
            "SPINDLE_SPEED_OUT_OF_RANGE");
  Operation pierce;
  pierce.kind = OperationKind::kPierce;
  EXPECT_EQ(PlanOf({pierce}).faults.at(0).reason, "OPERATION_NOT_DRIVEN");
}

TEST(SpatialCldata, ItsToolAxisIsThatOfTheRotaryWords) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<> angle(-1.5, 1.5);
  for (int i = 0; i < 1000; ++i) {
    const HeadAngles h{angle(random), 2.0 * angle(random)};
    const ToolAxis axis = AxisOf(ToolAngles::kRollPitch, h);
    const Vector3d meant = RollPitchYaw{h.a_rad, h.b_rad, 0.0}.Rotation().col(2);
    ASSERT_LE((Vector3d(axis[0], axis[1], axis[2]) - meant).norm(), 1e-14);
    const HeadAngles back = AnglesOf(ToolAngles::kRollPitch, axis);
    ASSERT_NEAR(back.a_rad, h.a_rad, 1e-12);
    ASSERT_NEAR(back.b_rad, h.b_rad, 1e-12);
  }
}

TEST(SpatialProgram, IsAdmittedOrRefusedAtTheRightCheck) {
  const auto admit = [](const std::string& text) { return AdmitSpatialProgram(text, WorkedModel(), {}); };
  const SpatialAdmission good = admit(ShippedHoles());
  EXPECT_TRUE(good.faults.empty());
  EXPECT_EQ(good.check, AdmissionCheck::kReach);
  EXPECT_GT(good.idle_length_mm, good.cutting_length_mm);
  const auto refused = [&](const std::string& text, AdmissionCheck check, const char* reason,
                           std::uint32_t line) {
    SCOPED_TRACE(text);
    const SpatialAdmission admission = admit(text);
    ASSERT_FALSE(admission.faults.empty());
    EXPECT_EQ(admission.check, check);
    EXPECT_EQ(admission.faults[0].reason, reason);
    EXPECT_EQ(admission.faults[0].line, line);
  };
  refused("G0 X0 Y0 Z20\nG1 Q\nM2\n", AdmissionCheck::kParse, "BAD_NUMBER", 2);
  refused("G0 Z20\nG1 X500 F600\nM2\n", AdmissionCheck::kPlace, "ACTUATOR_LIMIT", 2);
  refused("G0 Z20\nG1 A45 F600\nM2\n", AdmissionCheck::kPlace, "JOINT_LIMIT", 2);
  // Both ends can be held, the arc between them cannot.
  refused("G0 X-60 Z20\nG3 X60 I60 J-200 F600\nM2\n", AdmissionCheck::kReach, "ACTUATOR_LIMIT", 2);
  refused("PARTNO A\nMULTAX/ON\nFROM/0,0,20,0,0,1\nFEDRAT/600,MMPM\nGOTO/0,0,20,0,1,0\nFINI\n",
          AdmissionCheck::kPlace, "ACTUATOR_LIMIT", 5);
  refused("PARTNO A\nFROM/0,0,20\nCYCLE/TAP,DEPTH,12,MMPM,600,CLEAR,2\nFINI\n", AdmissionCheck::kParse,
          "CYCLE_UNKNOWN", 3);
  refused("PARTNO A\nFROM/0,0,20\nFEDRAT/600,MMPM\nCUTTER/6\nTLCOMP/LEFT\nGOTO/9,0,20\nFINI\n",
          AdmissionCheck::kParse, "COMPENSATION_NOT_SUPPORTED", 6);
}

// The largest share of a strut's limit that is played within two milliseconds of a path length; negative for other limits.
double ShareAbout(const SpatialPlan& plan, FeedLimit limit, double s_mm) {
  const HexapodMotion m = WorkedMotion();
  double share = -1.0;
  for (const SpatialSegment& s : plan.segments) {
    if (s.s_mm.value(s.duration_s) < s_mm - 1e-9 || s.s_mm.value(0.0) > s_mm + 1e-9) {
      continue;
    }
    double from = 0.0;
    while (from < s.duration_s && s.s_mm.value(from) < s_mm) {
      from += 1e-4;
    }
    for (double t = std::max(0.0, from - 2e-3); t <= std::min(s.duration_s, from + 2e-3); t += 1e-4) {
      for (std::size_t j = 0; j < kStrutCount; ++j) {
        const Polynomial& q = s.q_mm[j];
        if (limit == ActuatorVelocityLimit(j)) {
          share = std::max(share, std::abs(q.first(t)) / m.strut_velocity_mm_per_s);
        } else if (limit == ActuatorAccelerationLimit(j)) {
          share = std::max(share, std::abs(q.second(t)) / m.strut_acceleration_mm_per_s2);
        } else if (limit == FeedLimit::kActuatorJerk) {
          share = std::max(share, std::abs(q.third(t)) / m.strut_jerk_mm_per_s3);
        }
      }
    }
  }
  return share;
}

// Where a plan says that a strut's limit slows it, the struts use as much of it there as it says, within 1 %.
TEST(SpatialBinding, WhatIsNamedIsReachedWhereItIsNamed) {
  std::size_t stretches = 0, checked = 0;
  double worst_off = 0.0;
  std::array<double, kFeedLimitCount> length_mm{};
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    const PlannedSpatialProgram planned = PlanOf(RandomSpatialProgram(seed).Draw(12));
    ASSERT_TRUE(planned.faults.empty()) << FaultText(planned);
    double last_mm = 0.0, cut_mm = 0.0;
    for (const SlowStretch& slow : planned.slow) {
      ASSERT_GE(slow.from_s_mm, last_mm - 1e-9);
      ASSERT_GE(slow.at_s_mm, slow.from_s_mm);
      ASSERT_LE(slow.at_s_mm, slow.to_s_mm);
      last_mm = slow.to_s_mm;
      length_mm[static_cast<std::size_t>(slow.limit)] += slow.to_s_mm - slow.from_s_mm;
      ++stretches;
      EXPECT_EQ(slow.limit != FeedLimit::kSmoothing, slow.reached_share >= kLimitReached);
      const double share = ShareAbout(planned.plan, slow.nearest, slow.at_s_mm);
      if (share >= 0.0) {
        EXPECT_GE(share, slow.reached_share - 0.01) << FeedLimitName(slow.nearest) << " at " << slow.at_s_mm;
        worst_off = std::max(worst_off, slow.reached_share - share);
        ++checked;
      }
    }
    for (const BindingLength& b : planned.binding) {
      cut_mm += b.length_mm;
    }
    EXPECT_NEAR(cut_mm, planned.cutting_length_mm, 1e-6 * planned.cutting_length_mm);
  }
  for (std::size_t i = 0; i < kFeedLimitCount; ++i) {
    if (length_mm[i] > 0.0) {
      std::printf("%s binds over %.0f mm\n", std::string(FeedLimitName(static_cast<FeedLimit>(i))).c_str(),
                  length_mm[i]);
    }
  }
  std::printf("%zu stretches, %zu of them by struts: at worst %.4f of the limit less than said\n", stretches,
              checked, worst_off);
  EXPECT_GE(checked, 20u);
}

// Cycle by cycle at 10 kHz, against the program's own words.
TEST(SpatialPlay, KeepsThePathTheLimitsAndTheTimeAt10kHz) {
  const PartProgram program = ReadSpatialProgram(ShippedHoles(), WorkedMotion());
  const PlannedSpatialProgram planned = PlanOf(program.operations);
  ASSERT_TRUE(planned.faults.empty());
  const SpatialPlayReport played = PlaySpatialPlan(planned, program.operations, WorkedModel());
  std::printf(
      "%llu cycles: tip %.4f mm, turn %.6f rad, of tolerance %.4f, ends missed by %.4f mm; of limits speed "
      "%.4f "
      "acceleration %.4f jerk %.4f path %.6f; drives %.4f mm, following %.4f mm; %.3f s predicted, %.3f "
      "played\n",
      static_cast<unsigned long long>(played.cycles), played.tip_error_mm.value, played.turn_error_rad.value,
      played.tolerance_share.value, played.missed_end_mm.value, played.strut_speed_share.value,
      played.strut_acceleration_share.value, played.strut_jerk_share.value,
      played.path_acceleration_share.value, played.drives_tip_error_mm.value, played.following_mm.value,
      played.predicted_s, played.played_s);
  EXPECT_EQ(played.unsolved, 0u);
  EXPECT_NEAR(static_cast<double>(played.cycles), planned.plan.duration_s * 1e4, 3.0);
  EXPECT_LE(played.tolerance_share.value, 1.0);
  EXPECT_LE(played.missed_end_mm.value, 0.02);
  for (const WorstPlace& share : {played.strut_speed_share, played.strut_acceleration_share,
                                  played.strut_jerk_share, played.path_acceleration_share}) {
    EXPECT_GT(share.value, 0.1);
    EXPECT_LE(share.value, 1.0 + 1e-6);
  }
  EXPECT_NEAR(played.played_s, played.predicted_s, 0.01 * played.predicted_s);
}

// The ruler itself: a plan of another program is told to be off by what the programs differ.
TEST(SpatialPlay, SeesAPathThatIsNotTheProgrammedOne) {
  const auto line = [](double y) {
    return std::vector<Operation>{SpatialMove(OperationKind::kTraverse, {-30, y, 20}, {0, 0, 0}, 0, 1),
                                  SpatialMove(OperationKind::kFeedLine, {30, y, 20}, {0.1, 0, 0}, 60, 2)};
  };
  const PlannedSpatialProgram planned = PlanOf(line(0.0));
  SpatialPlayOptions options;
  options.cycle_s = 1e-3;
  std::vector<double> told;
  options.watch = [&told](double ratio) { told.push_back(ratio); };
  EXPECT_LE(PlaySpatialPlan(planned, line(0.0), WorkedModel(), options).tip_error_mm.value, 1e-6);
  EXPECT_GE(told.size(), 20u);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_GT(told.back(), 0.9);
  EXPECT_LE(told.back(), 1.0);
  const SpatialPlayReport off = PlaySpatialPlan(planned, line(0.5), WorkedModel(), options);
  EXPECT_NEAR(off.tip_error_mm.value, 0.5, 0.01);
  EXPECT_NEAR(off.missed_end_mm.value, 0.5, 0.01);
}

}  // namespace
}  // namespace lambdajet::trajectory
