#include "platform/bus/guard_key.hpp"

#include <sys/stat.h>

#include <sstream>

#include "foundation/contract/trouble.hpp"
#include "platform/process/atomic_file.hpp"

namespace lambdajet {
namespace {

constexpr std::size_t kLeastSecretBytes = 32;
constexpr std::size_t kMostKeys = 8;

bool ParseHex(const std::string& text, std::vector<std::uint8_t>& bytes) {
  if (text.size() % 2 != 0 || text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) {
    return false;
  }
  for (std::size_t i = 0; i < text.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes.size() >= kLeastSecretBytes;
}

constexpr char kKeyAdvice[] =
    "; bus.key_file names a file of lines '1 <64 hex digits>' (openssl rand -hex 32), mode 0400, the same on "
    "every host";

absl::Status BadLine(const std::string& path, int line) {
  return Trouble(absl::StatusCode::kInvalidArgument, "BAD_KEY_FILE",
                 path + ":" + std::to_string(line) +
                     ": must be a key id from 0 to 255 and at least 32 bytes in hex, with no id twice and at "
                     "most 8 keys");
}

}  // namespace

absl::StatusOr<std::vector<GuardKey>> ReadGuardKeys(const std::string& path) {
  const auto content = ReadWholeFile(path, 64 * 1024);
  if (!content.ok()) {
    return Trouble(content.status().code(), TroubleReason(content.status()),
                   "key file: " + std::string(content.status().message()) + kKeyAdvice, {{"path", path}});
  }
  struct stat about {};
  if (stat(path.c_str(), &about) != 0 || (about.st_mode & (S_IROTH | S_IWOTH | S_IWGRP)) != 0) {
    return Trouble(absl::StatusCode::kFailedPrecondition, "KEY_FILE_OPEN_TO_OTHERS",
                   "key file " + path + " can be read or written by others; right is mode 0600 or 0400");
  }
  std::vector<GuardKey> keys;
  std::istringstream lines(*content);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line.substr(0, line.find('#')));
    int id = -1;
    std::string hex;
    std::string more;
    if (!(words >> std::ws).good() && words.eof()) {
      continue;
    }
    GuardKey key;
    if (!(words >> id >> hex) || (words >> more) || id < 0 || id > 255 || !ParseHex(hex, key.secret)) {
      return BadLine(path, number);
    }
    key.id = static_cast<std::uint8_t>(id);
    for (const GuardKey& other : keys) {
      if (other.id == key.id || keys.size() >= kMostKeys) {
        return BadLine(path, number);
      }
    }
    keys.push_back(std::move(key));
  }
  if (keys.empty()) {
    return Trouble(absl::StatusCode::kInvalidArgument, "BAD_KEY_FILE",
                   "key file " + path + " holds no key" + kKeyAdvice);
  }
  return keys;
}

}  // namespace lambdajet
