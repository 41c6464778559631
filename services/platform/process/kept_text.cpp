#include "platform/process/kept_text.hpp"

#include <unistd.h>

#include <utility>

#include "foundation/contract/trouble.hpp"

namespace lambdajet {

KeptText::KeptText(std::string text, std::size_t most_in_memory) : size_(text.size()) {
  if (size_ > most_in_memory) {
    file_.reset(std::tmpfile());
    const bool filled = file_ != nullptr && std::fwrite(text.data(), 1, size_, file_.get()) == size_ &&
                        std::fflush(file_.get()) == 0;
    if (filled) {
      return;
    }
    file_.reset();
  }
  text_ = std::move(text);
}

absl::StatusOr<std::string> KeptText::Read() const {
  if (file_ == nullptr) {
    return text_;
  }
  std::string text(size_, '\0');
  for (std::size_t read = 0; read < size_;) {
    const ssize_t more =
        pread(fileno(file_.get()), text.data() + read, size_ - read, static_cast<off_t>(read));
    if (more <= 0) {
      return Trouble(absl::StatusCode::kDataLoss, "KEPT_TEXT_UNREADABLE",
                     "of " + std::to_string(size_) + " bytes only " + std::to_string(read) +
                         " came back from the temporary file; send the text again");
    }
    read += static_cast<std::size_t>(more);
  }
  return text;
}

}  // namespace lambdajet
