// A sample for tests of the bus itself: a number and a few bytes, serialised by hand, so that they need no IDL.
#pragma once

#include <cstdint>
#include <cstring>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <vector>

namespace lambdajet::test {

struct PlainSample {
  std::uint64_t number = 0;
  std::vector<std::uint8_t> bytes;
};

class PlainSamplePubSubType : public eprosima::fastdds::dds::TopicDataType {
 public:
  using type = PlainSample;
  static constexpr std::uint32_t kMostBytes = 200'000;

  PlainSamplePubSubType() {
    setName("lambdajet::test::PlainSample");
    m_typeSize = 4 + 8 + 4 + kMostBytes;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* sample, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const auto& plain = *static_cast<const PlainSample*>(sample);
    const auto size = static_cast<std::uint32_t>(plain.bytes.size());
    const std::uint8_t encapsulation[4] = {0, 1, 0, 0};
    std::memcpy(payload->data, encapsulation, 4);
    std::memcpy(payload->data + 4, &plain.number, 8);
    std::memcpy(payload->data + 12, &size, 4);
    std::memcpy(payload->data + 16, plain.bytes.data(), size);
    payload->encapsulation = CDR_LE;
    payload->length = 16 + size;
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* sample) override {
    auto& plain = *static_cast<PlainSample*>(sample);
    std::uint32_t size = 0;
    std::memcpy(&plain.number, payload->data + 4, 8);
    std::memcpy(&size, payload->data + 12, 4);
    plain.bytes.assign(payload->data + 16, payload->data + 16 + size);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* sample) override {
    return
        [sample] { return 16 + static_cast<std::uint32_t>(static_cast<PlainSample*>(sample)->bytes.size()); };
  }
  void* createData() override { return new PlainSample; }
  void deleteData(void* sample) override { delete static_cast<PlainSample*>(sample); }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

}  // namespace lambdajet::test
