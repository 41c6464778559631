#include "tests/support/child_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "tests/support/eventually.hpp"

namespace lambdajet::test {
namespace {

std::string Required(const char* name) {
  const char* value = std::getenv(name);
  if (value == nullptr) {
    throw std::runtime_error(std::string(name) + " is not set; run the test through ctest");
  }
  return value;
}

std::string NewFile() {
  std::string name = "/tmp/lambdajet-child-XXXXXX";
  const int file = mkostemp(name.data(), O_CLOEXEC);
  if (file < 0) {
    throw std::runtime_error("cannot make a file in /tmp");
  }
  close(file);
  return name;
}

std::string ReadAll(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

std::vector<std::string> Environment(const std::map<std::string, std::string>& added) {
  std::vector<std::string> entries;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (!added.contains(text.substr(0, text.find('=')))) {
      entries.push_back(text);
    }
  }
  for (const auto& [name, value] : added) {
    entries.push_back(name + "=" + value);
  }
  return entries;
}

std::vector<char*> Pointers(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) {
    pointers.push_back(text.data());
  }
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

std::string BinDir() { return Required("LAMBDAJET_BIN_DIR"); }
std::string SourceDir() { return Required("LAMBDAJET_SOURCE_DIR"); }

ChildProcess::ChildProcess(const ChildOptions& options)
    : announce_file_(options.announce_file), out_file_(NewFile()), err_file_(NewFile()) {
  const bool is_path = options.program.find('/') != std::string::npos;
  std::vector<std::string> arguments{is_path ? options.program : BinDir() + "/" + options.program};
  arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
  if (!announce_file_.empty()) {
    unlink(announce_file_.c_str());
    arguments.push_back("--announce_file=" + announce_file_);
  }
  std::vector<std::string> environment = Environment(options.environment);
  const std::vector<char*> argv = Pointers(arguments);
  const std::vector<char*> envp = Pointers(environment);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) {
      _exit(127);
    }
    dup2(open(out_file_.c_str(), O_WRONLY | O_APPEND), STDOUT_FILENO);
    dup2(open(err_file_.c_str(), O_WRONLY | O_APPEND), STDERR_FILENO);
    execve(argv[0], argv.data(), envp.data());
    _exit(127);
  }
  if (pid_ < 0) {
    throw std::runtime_error("cannot fork");
  }
}

ChildProcess::~ChildProcess() {
  if (running()) {
    kill(pid_, SIGKILL);
    Reap(true);
  }
  unlink(out_file_.c_str());
  unlink(err_file_.c_str());
}

bool ChildProcess::Reap(bool block) {
  int status = 0;
  if (!exit_code_ && waitpid(pid_, &status, block ? 0 : WNOHANG) == pid_) {
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return exit_code_.has_value();
}

bool ChildProcess::running() { return !Reap(false); }

std::optional<Announcement> ChildProcess::WaitUntilReady(std::chrono::milliseconds patience) {
  std::optional<Announcement> announcement;
  Eventually(
      [&] {
        const auto json = nlohmann::json::parse(ReadAll(announce_file_), nullptr, false);
        if (json.is_object()) {
          announcement = {json.value("pid", 0), json.value("rpc_port", 0), json.value("metrics_port", 0)};
        }
        return announcement.has_value() || !running();
      },
      patience);
  return announcement;
}

void ChildProcess::Signal(int number) {
  if (running()) {
    kill(pid_, number);
  }
}

std::optional<int> ChildProcess::WaitForExit(std::chrono::milliseconds patience) {
  Eventually([&] { return !running(); }, patience);
  return exit_code_;
}

std::string ChildProcess::out() const { return ReadAll(out_file_); }
std::string ChildProcess::err() const { return ReadAll(err_file_); }

}  // namespace lambdajet::test
