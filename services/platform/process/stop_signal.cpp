#include "platform/process/stop_signal.hpp"

#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

namespace lambdajet {
namespace {

sigset_t StopSet() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

StopSignal::StopSignal() {
  const sigset_t set = StopSet();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

std::optional<int> StopSignal::WaitFor(std::chrono::milliseconds time) const {
  const sigset_t set = StopSet();
  const timespec wait{.tv_sec = time.count() / 1000, .tv_nsec = (time.count() % 1000) * 1'000'000};
  const int number = sigtimedwait(&set, nullptr, &wait);
  return number > 0 ? std::optional<int>(number) : std::nullopt;
}

void StopSignal::Request() { kill(getpid(), SIGTERM); }

}  // namespace lambdajet
