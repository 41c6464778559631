// Throws mutated messages at the hexapod's wire converters and mutated text at its YAML reader: no crash, nothing on the wire
// that is not finite, and what is accepted can be written and read again.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "kinematics/rpc/kinematics_answers.hpp"
#include "kinematics/rpc/wire_hexapod_workspace.hpp"
#include "platform/machine_file/hexapod_file.hpp"
#include "tests/fuzz/byte_mutations.hpp"
#include "tests/papers/kinematics_hexapod_cases.hpp"

namespace lambdajet::kinematics {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

bool Finite(const Message& message) {
  const auto& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
        const double number = field->is_repeated() ? reflection.GetRepeatedDouble(message, field, i)
                                                   : reflection.GetDouble(message, field);
        if (!std::isfinite(number)) {
          return false;
        }
      } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        if (!Finite(field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                         : reflection.GetMessage(message, field))) {
          return false;
        }
      }
    }
  }
  return true;
}

void Place(const Eigen::Vector3d& p, v1::SpatialVector& wire) {
  wire.set_x_mm(p.x());
  wire.set_y_mm(p.y());
  wire.set_z_mm(p.z());
}

v1::MechanismSelection Selection() {
  v1::MechanismSelection selection;
  v1::HexapodGeometry& wire = *selection.mutable_hexapod();
  const HexapodGeometry geometry = worked::Geometry();
  for (int j = 0; j < kStruts; ++j) {
    v1::StrutGeometry& strut = *wire.add_strut();
    Place(geometry.p_MA_mm.col(j), *strut.mutable_p_ma());
    Place(geometry.p_PB_mm.col(j), *strut.mutable_p_pb());
    if (j % 2 == 1) {
      strut.mutable_joint()->set_ez_mm(0.05);
    }
  }
  wire.set_strut_max_mm(1200);
  wire.set_singular_margin(0.1);
  wire.set_screw_lead_mm(5);
  Place({0, 0, 800}, *wire.mutable_x_mp_home()->mutable_position());
  wire.mutable_x_pt()->mutable_quaternion()->set_w(1.0);
  return selection;
}

template <class Request, class Response, class Ask>
void Throw(const Request& seed, unsigned random_seed, int count, const Ask& ask) {
  test::ByteMutations mutate(random_seed);
  const std::string bytes = seed.SerializeAsString();
  int understood = 0, solved = 0;
  for (int i = 0; i < count; ++i) {
    Request request;
    if (!request.ParseFromString(mutate(bytes))) {
      continue;
    }
    ++understood;
    Response response;
    const absl::Status status = ask(request, response);
    solved += status.ok() ? 1 : 0;
    ASSERT_TRUE(!status.ok() || Finite(response)) << request.ShortDebugString() << "\n"
                                                  << response.ShortDebugString();
  }
  EXPECT_GT(understood, count / 50);  // most of the rest is not a message any more
  EXPECT_GT(solved, 0);
}

class HexapodFuzz : public testing::Test {
 protected:
  MachineSlot slot_;
  KinematicsAnswers answers_{slot_};
};

TEST_F(HexapodFuzz, InverseWithMotion) {
  v1::SolveInverseRequest request;
  *request.mutable_mechanism() = Selection();
  Place({50, 20, 830}, *request.mutable_x_mt()->mutable_position());
  request.mutable_x_mt()->mutable_krylov()->set_psi_rad(0.1);
  for (int i = 0; i < 6; ++i) {
    request.mutable_motion()->add_twist(0.1 * i);
    request.mutable_motion()->add_twist_rate(0.2 * i);
  }
  Throw<v1::SolveInverseRequest, v1::SolveInverseResponse>(
      request, 1, 20000,
      [&](const auto& asked, auto& answer) { return answers_.SolveInverse(asked, answer); });
}

TEST_F(HexapodFuzz, ForwardWithMotion) {
  v1::SolveForwardRequest request;
  *request.mutable_mechanism() = Selection();
  for (int i = 0; i < 6; ++i) {
    request.add_actuator_position_mm(890.0 + i);
    request.add_actuator_velocity_mm_per_s(i);
    request.add_actuator_acceleration_mm_per_s2(i);
  }
  Throw<v1::SolveForwardRequest, v1::SolveForwardResponse>(
      request, 2, 10000,
      [&](const auto& asked, auto& answer) { return answers_.SolveForward(asked, answer); });
}

TEST_F(HexapodFuzz, Batches) {
  v1::SolveInverseBatchRequest request;
  *request.mutable_mechanism() = Selection();
  request.set_stride(6);
  for (int i = 0; i < 60; ++i) {
    request.add_pose(i % 6 == 2 ? 800.0 : 0.05 * (i % 7));
  }
  Throw<v1::SolveInverseBatchRequest, v1::SolveInverseBatchResponse>(
      request, 3, 10000, [&](const auto& asked, auto& answer) { return answers_.SolveBatch(asked, answer); });
}

TEST_F(HexapodFuzz, JacobianAndSingularity) {
  v1::ComputeJacobianRequest jacobian;
  *jacobian.mutable_mechanism() = Selection();
  Place({50, 20, 830}, *jacobian.mutable_x_mt()->mutable_position());
  Throw<v1::ComputeJacobianRequest, v1::ComputeJacobianResponse>(
      jacobian, 4, 5000,
      [&](const auto& asked, auto& answer) { return answers_.ComputeJacobian(asked, answer); });
  v1::ReportSingularityRequest singularity;
  *singularity.mutable_mechanism() = Selection();
  Place({50, 20, 830}, *singularity.mutable_x_mt()->mutable_position());
  Throw<v1::ReportSingularityRequest, v1::ReportSingularityResponse>(
      singularity, 5, 5000,
      [&](const auto& asked, auto& answer) { return answers_.ReportSingularity(asked, answer); });
}

TEST_F(HexapodFuzz, WorkspaceAndServiceArea) {
  v1::ComputeHexapodWorkspaceRequest workspace;
  *workspace.mutable_mechanism() = Selection();
  Place({-300, -300, 700}, *workspace.mutable_box_from());
  Place({300, 300, 900}, *workspace.mutable_box_to());
  workspace.set_step_mm(200);
  workspace.add_slice_z_mm(800);
  workspace.set_voxels(true);
  Throw<v1::ComputeHexapodWorkspaceRequest, v1::ComputeHexapodWorkspaceResponse>(
      workspace, 6, 1000, [&](const auto& asked, auto& answer) {
        int rows = 0;  // a mutated step may ask for millions of samples: give up as a client would
        return ComputeHexapodWorkspace(
            slot_, asked, [&rows] { return ++rows > 30; }, answer);
      });
  v1::ComputeServiceAreaRequest area;
  (*area.mutable_parameter())["tilt_rad"] = 0.3;
  (*area.mutable_parameter())["strut_min_mm"] = 450;
  (*area.mutable_parameter())["frame_bottom_ratio"] = 1.2;
  area.set_sweep_parameter("tool_length_mm");
  area.set_sweep_to(200);
  area.set_sweep_points(3);
  Throw<v1::ComputeServiceAreaRequest, v1::ComputeServiceAreaResponse>(
      area, 7, 5000,
      [&](const auto& asked, auto& answer) { return answers_.ComputeServiceArea(asked, answer); });
}

TEST(HexapodFileFuzz, RefusesOrReadsWhatCanBeWrittenAgain) {
  std::ostringstream text;
  text << std::ifstream(std::string(std::getenv("LAMBDAJET_SOURCE_DIR")) + "/deploy/config/hexapod.yaml")
              .rdbuf();
  test::ByteMutations mutate(8);
  int read = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto machine = ParseHexapod(mutate(text.str()), "fuzz");
    if (machine.ok()) {
      ++read;
      ASSERT_EQ(FaultOf(machine->geometry), "");
      const HexapodInverse home = SolveInverse(Hexapod(machine->geometry), machine->geometry.X_MP_home);
      ASSERT_TRUE(home.lengths_mm.allFinite());
    }
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace lambdajet::kinematics
