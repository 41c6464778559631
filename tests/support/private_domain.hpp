// Reserves a DDS domain for one test, so that tests that run at once do not hear each other.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace lambdajet::test {

// Domain 1 to 200, held by a lock on a file in /tmp until destroyed; the lock falls with the process.
class PrivateDomain {
 public:
  PrivateDomain() {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const int start = static_cast<int>(getpid() % 200);
    while (!Reserve(start)) {
      if (std::chrono::steady_clock::now() > deadline) {
        throw std::runtime_error("no free DDS domain for this test");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  ~PrivateDomain() { close(file_); }
  PrivateDomain(const PrivateDomain&) = delete;
  PrivateDomain& operator=(const PrivateDomain&) = delete;

  int number() const { return number_; }

 private:
  bool Reserve(int start) {
    for (int i = 0; i < 200; ++i) {
      const int number = 1 + (start + i) % 200;
      const std::string path = "/tmp/lambdajet-test-domain-" + std::to_string(number) + ".lock";
      const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) {
        file_ = file;
        number_ = number;
        return true;
      }
      close(file);
    }
    return false;
  }

  int file_ = -1;
  int number_ = 0;
};

}  // namespace lambdajet::test
