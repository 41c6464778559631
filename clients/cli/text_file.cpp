#include "clients/cli/text_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

constexpr std::size_t kLargestFile_bytes = 128U << 20U;

struct CloseFile {
  void operator()(std::FILE* file) const {
    if (file != stdin && file != stdout) {
      std::fclose(file);
    }
  }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace

absl::StatusOr<std::string> ReadTextFile(const std::string& path) {
  const File file(path == "-" ? stdin : std::fopen(path.c_str(), "rb"));
  if (file == nullptr) {
    return Trouble(absl::StatusCode::kNotFound, "FILE_NOT_READ",
                   fmt::format("{}: {}", path, std::strerror(errno)));
  }
  std::string text;
  char buffer[65536];
  std::size_t count = 0;
  while ((count = std::fread(buffer, 1, sizeof buffer, file.get())) > 0) {
    text.append(buffer, count);
    if (text.size() > kLargestFile_bytes) {
      return Trouble(absl::StatusCode::kInvalidArgument, "FILE_TOO_LARGE",
                     fmt::format("{}: larger than {} MiB", path, kLargestFile_bytes >> 20U));
    }
  }
  if (std::ferror(file.get()) != 0) {
    return Trouble(absl::StatusCode::kNotFound, "FILE_NOT_READ",
                   fmt::format("{}: {}", path, std::strerror(errno)));
  }
  return text;
}

absl::Status WriteTextFile(const std::string& path, std::string_view text) {
  const File file(path == "-" ? stdout : std::fopen(path.c_str(), "wb"));
  if (file == nullptr || std::fwrite(text.data(), 1, text.size(), file.get()) != text.size() ||
      std::fflush(file.get()) != 0) {
    return Trouble(absl::StatusCode::kInternal, "FILE_NOT_WRITTEN",
                   fmt::format("{}: {}", path, std::strerror(errno)));
  }
  return absl::OkStatus();
}

}  // namespace lambdajet::cli
