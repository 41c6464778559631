#include "platform/bus/guard_transport.hpp"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>

#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <random>
#include <thread>

namespace lambdajet {

namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::LocatorsIterator;
using eprosima::fastrtps::rtps::octet;
using eprosima::fastrtps::rtps::SenderResource;

class GuardState::Dice {
 public:
  std::mutex mutex;
  LinkFaults faults;
  std::mt19937_64 numbers;
};

GuardState::GuardState(std::unique_ptr<DatagramGuard> guard, const LinkFaults& faults)
    : guard_(std::move(guard)), dice_(std::make_unique<Dice>()) {
  SetFaults(faults);
}
GuardState::~GuardState() = default;

void GuardState::SetFaults(const LinkFaults& faults) {
  const std::lock_guard lock(dice_->mutex);
  dice_->faults = faults;
  dice_->numbers.seed(faults.seed);
  faulty_.store(faults.any(), std::memory_order_release);
}

GuardState::Fate GuardState::Draw() {
  if (!faulty_.load(std::memory_order_acquire)) [[likely]] {
    return {};
  }
  const std::lock_guard lock(dice_->mutex);
  std::uniform_real_distribution<double> ratio(0.0, 1.0);
  const double drop = ratio(dice_->numbers);
  const double duplicate = ratio(dice_->numbers);
  const double delay = ratio(dice_->numbers);
  Fate fate;
  fate.copies = drop < dice_->faults.drop_ratio ? 0 : (duplicate < dice_->faults.duplicate_ratio ? 2 : 1);
  fate.delay_s = delay < dice_->faults.delay_ratio ? dice_->faults.delay_s : 0.0;
  return fate;
}

namespace {

constexpr std::size_t kMostLateDatagrams = 4096;

// Delivers datagrams later, for tests; its thread starts with the first of them.
class LateDelivery {
 public:
  ~LateDelivery() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  void Add(rtps::TransportReceiverInterface* receiver, const octet* bytes, std::uint32_t size,
           const Locator_t& local, const Locator_t& remote, double delay_s) {
    const std::lock_guard lock(mutex_);
    if (late_.size() >= kMostLateDatagrams) {
      return;
    }
    const auto due = std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                            std::chrono::duration<double>(delay_s));
    late_.push_back({due, receiver, std::vector<octet>(bytes, bytes + size), local, remote});
    if (!thread_.joinable()) {
      thread_ = std::thread([this] { Deliver(); });
    }
    changed_.notify_all();
  }

  // Nothing for that channel is delivered after this returns.
  void Forget(const Locator_t& local) {
    std::unique_lock lock(mutex_);
    late_.remove_if([&](const Late& entry) { return entry.local == local; });
    changed_.wait_for(lock, std::chrono::seconds(1), [&] { return !delivering_; });
  }

 private:
  struct Late {
    std::chrono::steady_clock::time_point due;
    rtps::TransportReceiverInterface* receiver;
    std::vector<octet> bytes;
    Locator_t local;
    Locator_t remote;
  };

  void Deliver() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
      if (late_.empty()) {
        changed_.wait(lock);
      } else if (late_.front().due > std::chrono::steady_clock::now()) {
        changed_.wait_until(lock, late_.front().due);
      } else {
        const Late entry = std::move(late_.front());
        late_.pop_front();
        delivering_ = true;
        lock.unlock();
        entry.receiver->OnDataReceived(entry.bytes.data(), static_cast<std::uint32_t>(entry.bytes.size()),
                                       entry.local, entry.remote);
        lock.lock();
        delivering_ = false;
        changed_.notify_all();
      }
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Late> late_;
  bool delivering_ = false;
  bool stop_ = false;
  std::thread thread_;
};

class GuardDescriptor : public rtps::ChainingTransportDescriptor {
 public:
  GuardDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> low_level,
                  std::shared_ptr<GuardState> shared)
      : rtps::ChainingTransportDescriptor(std::move(low_level)), state(std::move(shared)) {
    maxMessageSize -= 64;  // the trailer, and on to a multiple of four for the fragmenter
  }
  rtps::TransportInterface* create_transport() const override;
  std::uint32_t min_send_buffer_size() const override { return maxMessageSize; }
  std::uint32_t max_message_size() const override { return maxMessageSize; }

  std::shared_ptr<GuardState> state;
};

class GuardTransport : public rtps::ChainingTransport {
 public:
  explicit GuardTransport(const GuardDescriptor& descriptor)
      : rtps::ChainingTransport(descriptor), descriptor_(descriptor), state_(descriptor.state) {}

  rtps::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool send(SenderResource* low, const octet* bytes, std::uint32_t size, LocatorsIterator* begin,
            LocatorsIterator* end, const std::chrono::steady_clock::time_point& timeout) override {
    DatagramGuard* guard = state_->guard();
    if (guard == nullptr) {
      return low->send(bytes, size, begin, end, timeout);
    }
    const std::lock_guard lock(send_mutex_);
    guard->Seal({bytes, size}, sealed_);
    return low->send(sealed_.data(), static_cast<std::uint32_t>(sealed_.size()), begin, end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* next, const octet* bytes, std::uint32_t size,
               const Locator_t& local, const Locator_t& remote) override {
    if (DatagramGuard* guard = state_->guard()) {
      const auto payload = guard->Open({bytes, size});
      if (!payload) {
        return;
      }
      size = static_cast<std::uint32_t>(*payload);
    }
    const GuardState::Fate fate = state_->Draw();
    for (int i = 0; i < fate.copies; ++i) {
      if (fate.delay_s > 0.0) {
        late_.Add(next, bytes, size, local, remote, fate.delay_s);
      } else {
        next->OnDataReceived(bytes, size, local, remote);
      }
    }
  }

  bool CloseInputChannel(const Locator_t& locator) override {
    const bool closed = rtps::ChainingTransport::CloseInputChannel(locator);
    late_.Forget(locator);
    return closed;
  }

 private:
  GuardDescriptor descriptor_;
  std::shared_ptr<GuardState> state_;
  std::mutex send_mutex_;
  std::vector<std::uint8_t> sealed_;
  LateDelivery late_;
};

rtps::TransportInterface* GuardDescriptor::create_transport() const { return new GuardTransport(*this); }

}  // namespace

std::shared_ptr<rtps::TransportDescriptorInterface> MakeGuardedTransport(
    std::shared_ptr<rtps::TransportDescriptorInterface> low_level, std::shared_ptr<GuardState> state) {
  return std::make_shared<GuardDescriptor>(std::move(low_level), std::move(state));
}

}  // namespace lambdajet
