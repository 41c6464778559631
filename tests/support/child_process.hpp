// Starts a program for a test, waits until it is ready, signals it, and never leaves it behind.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace lambdajet::test {

// Environment variables of the test runner: where the programs are, where the sources are.
std::string BinDir();
std::string SourceDir();

struct ChildOptions {
  std::string program;  // a name in LAMBDAJET_BIN_DIR, or a path with a '/'
  std::vector<std::string> arguments;
  std::map<std::string, std::string> environment;  // added to the test's own
  std::string announce_file;  // if set, --announce_file=… is added and the file removed first
};

// What a house writes to its announce file when it is ready.
struct Announcement {
  int pid = 0;
  int rpc_port = 0;
  int metrics_port = 0;
};

class ChildProcess {
 public:
  explicit ChildProcess(const ChildOptions& options);
  ~ChildProcess();  // SIGKILL to this child only, if it still runs
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  int pid() const { return pid_; }
  bool running();

  // Nothing if the child ended or the time passed before the announce file was complete.
  std::optional<Announcement> WaitUntilReady(std::chrono::milliseconds patience = std::chrono::seconds(20));

  void Signal(int number);  // SIGTERM, SIGKILL, SIGSTOP, …

  // The exit code, 128 + signal if it was killed, nothing if it still runs after the time.
  std::optional<int> WaitForExit(std::chrono::milliseconds patience = std::chrono::seconds(20));

  std::string out() const;  // what it has written so far
  std::string err() const;

 private:
  bool Reap(bool block);

  std::string announce_file_;
  std::string out_file_;
  std::string err_file_;
  int pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace lambdajet::test
