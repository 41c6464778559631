// Keeps a text that is seldom read: a short one in memory, a long one in a file without a name that ends with the object.
//
// Model: the file is made in the folder for temporary files and has no name from the start, so that nothing is left behind
// however the process ends; where it cannot be made or filled, the text stays in memory. Units: bytes.
// Threads: Read() from any. Errors: DATA_LOSS KEPT_TEXT_UNREADABLE where the file does not give back what was written.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace lambdajet {

class KeptText {
 public:
  KeptText() = default;
  // One of more than `most_in_memory` bytes goes into a file.
  KeptText(std::string text, std::size_t most_in_memory);

  std::size_t size() const { return size_; }
  bool in_file() const { return file_ != nullptr; }
  absl::StatusOr<std::string> Read() const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::size_t size_ = 0;
  std::string text_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace lambdajet
