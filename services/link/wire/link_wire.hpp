// Translates the samples of the electronic link between the wire and foundation/motion.
//
// Model: one FromWire or ToWire a type, for every bus door: a sample that two doors translate each by itself is soon two
// samples. FromWire refuses (false) what cannot have come from a sound writer: numbers that are not finite, counts beyond
// the arrays, enumerators nobody knows. The parts of a plan are taken apart into all of their members, so that a new member
// does not compile until it is sent or named as staying behind; source lines stay behind.
// Threads: pure. Cost: a copy; no allocation.
#pragma once

#include "foundation/motion/link_samples.hpp"

namespace lambdajet::idl {
namespace drive::v1 {
class State;
}
namespace main_motion::v1 {
class State;
class Measurement;
class ProcessRecord;
}  // namespace main_motion::v1
namespace cell::v1 {
class Command;
}
namespace trajectory::v1 {
class SegmentBatch;
class ProcessBatch;
}  // namespace trajectory::v1
namespace link::v1 {
class Header;
}
}  // namespace lambdajet::idl

namespace lambdajet::link {

void ToWire(const SampleHeader& sample, idl::link::v1::Header& wire);
SampleHeader FromWire(const idl::link::v1::Header& wire);

void ToWire(const DriveState& sample, idl::drive::v1::State& wire);
void ToWire(const MainMotionState& sample, idl::main_motion::v1::State& wire);
void ToWire(const Measurement& sample, idl::main_motion::v1::Measurement& wire);
void ToWire(const ProcessRecord& sample, idl::main_motion::v1::ProcessRecord& wire);
void ToWire(const ModuleCommand& sample, idl::cell::v1::Command& wire);
void ToWire(const SegmentBatch& sample, idl::trajectory::v1::SegmentBatch& wire);
void ToWire(const ProcessBatch& sample, idl::trajectory::v1::ProcessBatch& wire);

bool FromWire(const idl::drive::v1::State& wire, DriveState& sample);
bool FromWire(const idl::main_motion::v1::State& wire, MainMotionState& sample);
bool FromWire(const idl::main_motion::v1::Measurement& wire, Measurement& sample);
bool FromWire(const idl::main_motion::v1::ProcessRecord& wire, ProcessRecord& sample);
bool FromWire(const idl::cell::v1::Command& wire, ModuleCommand& sample);
bool FromWire(const idl::trajectory::v1::SegmentBatch& wire, SegmentBatch& sample);
bool FromWire(const idl::trajectory::v1::ProcessBatch& wire, ProcessBatch& sample);

}  // namespace lambdajet::link
