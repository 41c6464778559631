#include "platform/process/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) {
      close(number_);
    }
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  bool open() const { return number_ >= 0; }

 private:
  int number_;
};

absl::Status FileTrouble(const char* what, const std::string& path, int error) {
  const std::string message = std::string(what) + " " + path + ": " + std::strerror(error);
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return Trouble(absl::StatusCode::kResourceExhausted, "DISK_FULL", message, {{"path", path}});
    case EACCES:
    case EPERM:
    case EROFS:
      return Trouble(absl::StatusCode::kPermissionDenied, "NOT_PERMITTED", message, {{"path", path}});
    case ENOENT:
    case ENOTDIR:
      return Trouble(absl::StatusCode::kNotFound, "NO_SUCH_FILE", message, {{"path", path}});
    default:
      return Trouble(absl::StatusCode::kInternal, "FILE_TROUBLE", message, {{"path", path}});
  }
}

absl::Status WriteAll(int file, std::string_view content, const std::string& path) {
  while (!content.empty()) {
    const ssize_t written = write(file, content.data(), content.size());
    if (written < 0 && errno != EINTR) {
      return FileTrouble("cannot write", path, errno);
    }
    content.remove_prefix(written > 0 ? static_cast<std::size_t>(written) : 0);
  }
  return fsync(file) == 0 ? absl::OkStatus() : FileTrouble("cannot bring to disk", path, errno);
}

absl::Status SyncFolderOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const Descriptor descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!descriptor.open() || fsync(descriptor.number()) != 0) {
    return FileTrouble("cannot bring to disk the folder", folder, errno);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteFileAtomically(const std::string& path, std::string_view content) {
  std::string temporary = path + ".XXXXXX";
  absl::Status status;
  {
    const Descriptor file(mkostemp(temporary.data(), O_CLOEXEC));
    if (!file.open()) {
      return FileTrouble("cannot create a file beside", path, errno);
    }
    fchmod(file.number(), 0644);
    status = WriteAll(file.number(), content, path);
  }
  if (status.ok() && rename(temporary.c_str(), path.c_str()) != 0) {
    status = FileTrouble("cannot rename to", path, errno);
  }
  if (!status.ok()) {
    unlink(temporary.c_str());
    return status;
  }
  return SyncFolderOf(path);
}

absl::Status CheckFileCanBeWritten(const std::string& path) {
  struct stat about {};
  if (stat(path.c_str(), &about) == 0 && S_ISDIR(about.st_mode)) {
    return FileTrouble("cannot write", path, EISDIR);
  }
  std::string temporary = path + ".XXXXXX";
  const Descriptor file(mkostemp(temporary.data(), O_CLOEXEC));
  if (!file.open()) {
    return FileTrouble("cannot create a file beside", path, errno);
  }
  unlink(temporary.c_str());
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadWholeFile(const std::string& path, std::size_t most_bytes) {
  // Non-blocking, so that a FIFO in the place of a file is refused and not waited for.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.open()) {
    return FileTrouble("cannot open", path, errno);
  }
  struct stat about {};
  if (fstat(file.number(), &about) != 0 || !S_ISREG(about.st_mode)) {
    return Trouble(absl::StatusCode::kInvalidArgument, "NOT_A_FILE", path + " is not a regular file",
                   {{"path", path}});
  }
  std::string content;
  char block[16384];
  while (content.size() <= most_bytes) {
    const ssize_t got = read(file.number(), block, sizeof block);
    if (got < 0 && errno != EINTR) {
      return FileTrouble("cannot read", path, errno);
    }
    if (got == 0) {
      return content;
    }
    content.append(block, got > 0 ? static_cast<std::size_t>(got) : 0);
  }
  return Trouble(absl::StatusCode::kOutOfRange, "FILE_TOO_LARGE",
                 path + " is larger than " + std::to_string(most_bytes) + " bytes", {{"path", path}});
}

}  // namespace lambdajet
