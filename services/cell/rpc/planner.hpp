// Is the cell as a client of trajectory: admits and plans programs, and keeps the running plan streaming.
//
// Model: two threads with a queue each at the desk: admissions of new jobs, and what the machine needs now. Every call has
// a deadline; a plan is asked for until it is done. Trajectory away or without a machine description is passing trouble:
// an admission is tried again, a start is given up with the reason. The same request gives the same plan id, so a restarted
// trajectory makes the plan that the drive is playing anew.
// Threads: two of its own, from Start to its end. Errors: told to the desk with trajectory's own reason, or
// TRAJECTORY_UNREACHABLE.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "cell/desk/cell_config.hpp"
#include "cell/desk/job_desk.hpp"

namespace grpc {
class Channel;
}

namespace lambdajet::cell {

class Planner {
 public:
  static absl::StatusOr<std::unique_ptr<Planner>> Open(JobDesk& desk, const CellConfig& config);
  Planner(JobDesk& desk, std::shared_ptr<grpc::Channel> trajectory);
  // The desk is closed first; waits for the call that is under way, a few seconds at most.
  ~Planner();

 private:
  class Trajectory;
  void Admit();
  void Serve();
  void Watch();
  Admission AdmitOne(const AdmissionTask& task);
  void ServeOne(const MachineTask& task);

  JobDesk& desk_;
  std::unique_ptr<Trajectory> trajectory_;
  std::atomic<bool> stop_ = false;
  std::thread admit_;
  std::thread serve_;
  std::thread watch_;
};

}  // namespace lambdajet::cell
