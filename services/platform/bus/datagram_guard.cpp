#include "platform/bus/datagram_guard.hpp"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/params.h>
#include <openssl/rand.h>

#include <cstring>
#include <list>
#include <mutex>
#include <unordered_map>

#include "foundation/contract/expects.hpp"

namespace lambdajet {
namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kTagBytes = 16;
constexpr std::size_t kMostSenders = 256;

using Tag = std::array<std::uint8_t, EVP_MAX_MD_SIZE>;

// HMAC-SHA256 with one key; keeps its context, so a tag costs no allocation and no key schedule.
class Mac {
 public:
  explicit Mac(const GuardKey& key) : id_(key.id) {
    EVP_MAC* algorithm = EVP_MAC_fetch(nullptr, "HMAC", nullptr);
    context_ = EVP_MAC_CTX_new(algorithm);
    EVP_MAC_free(algorithm);
    char digest[] = "SHA256";
    const OSSL_PARAM parameters[] = {OSSL_PARAM_construct_utf8_string("digest", digest, 0),
                                     OSSL_PARAM_construct_end()};
    Expects(EVP_MAC_init(context_, key.secret.data(), key.secret.size(), parameters) == 1,
            "HMAC-SHA256 starts");
  }
  ~Mac() { EVP_MAC_CTX_free(context_); }
  Mac(const Mac&) = delete;
  Mac& operator=(const Mac&) = delete;

  std::uint8_t id() const { return id_; }

  void Sign(std::span<const std::uint8_t> bytes, Tag& tag) {
    std::size_t size = 0;
    EVP_MAC_init(context_, nullptr, 0, nullptr);
    EVP_MAC_update(context_, bytes.data(), bytes.size());
    EVP_MAC_final(context_, tag.data(), &size, tag.size());
  }

 private:
  std::uint8_t id_;
  EVP_MAC_CTX* context_ = nullptr;
};

void AppendLittleEndian(std::vector<std::uint8_t>& bytes, std::uint64_t number) {
  for (int i = 0; i < 8; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
  }
}

std::uint64_t ReadLittleEndian(const std::uint8_t* bytes) {
  std::uint64_t number = 0;
  for (int i = 0; i < 8; ++i) {
    number |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
  }
  return number;
}

std::uint64_t DrawSender() {
  std::uint64_t sender = 0;
  Expects(RAND_bytes(reinterpret_cast<unsigned char*>(&sender), sizeof sender) == 1,
          "the system has random numbers");
  return sender;
}

}  // namespace

const char* GuardVerdictName(GuardVerdict verdict) {
  switch (verdict) {
    case GuardVerdict::kAccepted:
      return "accepted";
    case GuardVerdict::kTooShort:
      return "too_short";
    case GuardVerdict::kBadVersion:
      return "bad_version";
    case GuardVerdict::kUnknownKey:
      return "unknown_key";
    case GuardVerdict::kBadTag:
      return "bad_tag";
    case GuardVerdict::kReplayed:
      return "replayed";
    case GuardVerdict::kCount:
      break;
  }
  return "unknown";
}

bool ReplayWindow::Accept(std::uint64_t counter) {
  const auto bit = [](std::uint64_t c) { return std::uint64_t{1} << (c % 64); };
  const auto word = [this](std::uint64_t c) -> std::uint64_t& { return seen_[(c % kSize) / 64]; };
  if (!started_) {
    started_ = true;
    highest_ = counter;
  } else if (counter > highest_) {
    if (counter - highest_ >= kSize) {
      seen_.fill(0);
    } else {
      for (std::uint64_t c = highest_ + 1; c < counter; ++c) {
        word(c) &= ~bit(c);
      }
    }
    highest_ = counter;
  } else if (highest_ - counter >= kSize || (word(counter) & bit(counter)) != 0) {
    return false;
  }
  word(counter) |= bit(counter);
  return true;
}

class DatagramGuard::Inside {
 public:
  explicit Inside(const std::vector<GuardKey>& keys) : signer_(keys.front()), sender_(DrawSender()) {
    for (const GuardKey& key : keys) {
      checkers_.emplace_back(key);
    }
  }

  std::mutex send_mutex_;
  Mac signer_;
  const std::uint64_t sender_;
  std::uint64_t counter_ = 0;

  std::mutex receive_mutex_;
  std::list<Mac> checkers_;
  struct Sender {
    ReplayWindow window;
    std::uint64_t last_heard = 0;
  };
  std::unordered_map<std::uint64_t, Sender> senders_;
  std::uint64_t heard_ = 0;

  Mac* Checker(std::uint8_t id) {
    for (Mac& mac : checkers_) {
      if (mac.id() == id) {
        return &mac;
      }
    }
    return nullptr;
  }

  ReplayWindow& WindowOf(std::uint64_t sender) {
    if (senders_.size() >= kMostSenders && senders_.find(sender) == senders_.end()) {
      auto oldest = senders_.begin();
      for (auto it = senders_.begin(); it != senders_.end(); ++it) {
        oldest = it->second.last_heard < oldest->second.last_heard ? it : oldest;
      }
      senders_.erase(oldest);
    }
    Sender& entry = senders_[sender];
    entry.last_heard = ++heard_;
    return entry.window;
  }
};

DatagramGuard::DatagramGuard(std::vector<GuardKey> keys) {
  Expects(!keys.empty(), "a guard has a key");
  inside_ = std::make_unique<Inside>(keys);
}
DatagramGuard::~DatagramGuard() = default;

void DatagramGuard::Seal(std::span<const std::uint8_t> payload, std::vector<std::uint8_t>& sealed) {
  sealed.reserve(payload.size() + kGuardOverheadBytes);
  sealed.assign(payload.begin(), payload.end());
  const std::lock_guard lock(inside_->send_mutex_);
  sealed.push_back(kVersion);
  sealed.push_back(inside_->signer_.id());
  AppendLittleEndian(sealed, inside_->sender_);
  AppendLittleEndian(sealed, ++inside_->counter_);
  Tag tag;
  inside_->signer_.Sign(sealed, tag);
  sealed.insert(sealed.end(), tag.begin(), tag.begin() + kTagBytes);
}

GuardVerdict DatagramGuard::Judge(std::span<const std::uint8_t> datagram) {
  if (datagram.size() < kGuardOverheadBytes) {
    return GuardVerdict::kTooShort;
  }
  const std::uint8_t* trailer = datagram.data() + datagram.size() - kGuardOverheadBytes;
  if (trailer[0] != kVersion) {
    return GuardVerdict::kBadVersion;
  }
  const std::lock_guard lock(inside_->receive_mutex_);
  Mac* checker = inside_->Checker(trailer[1]);
  if (checker == nullptr) {
    return GuardVerdict::kUnknownKey;
  }
  Tag tag;
  checker->Sign(datagram.first(datagram.size() - kTagBytes), tag);
  if (CRYPTO_memcmp(tag.data(), datagram.data() + datagram.size() - kTagBytes, kTagBytes) != 0) {
    return GuardVerdict::kBadTag;
  }
  const bool fresh = inside_->WindowOf(ReadLittleEndian(trailer + 2)).Accept(ReadLittleEndian(trailer + 10));
  return fresh ? GuardVerdict::kAccepted : GuardVerdict::kReplayed;
}

std::optional<std::size_t> DatagramGuard::Open(std::span<const std::uint8_t> datagram) {
  const GuardVerdict verdict = Judge(datagram);
  counts_[static_cast<std::size_t>(verdict)].fetch_add(1, std::memory_order_relaxed);
  if (verdict != GuardVerdict::kAccepted) {
    return std::nullopt;
  }
  return datagram.size() - kGuardOverheadBytes;
}

std::uint64_t DatagramGuard::count(GuardVerdict verdict) const {
  return counts_[static_cast<std::size_t>(verdict)].load(std::memory_order_relaxed);
}

}  // namespace lambdajet
