// Changes bytes at random, seeded: flips, cuts, doublings, splices, and numbers that arithmetic does not like.
#pragma once

#include <array>
#include <cstring>
#include <limits>
#include <random>
#include <string>

namespace lambdajet::test {

class ByteMutations {
 public:
  explicit ByteMutations(unsigned seed) : random_(seed) {}

  std::string operator()(std::string bytes) {
    const int changes = 1 + static_cast<int>(Below(6));
    for (int i = 0; i < changes; ++i) {
      ChangeOnce(bytes);
    }
    return bytes;
  }
  std::size_t Below(std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_);
  }

 private:
  void ChangeOnce(std::string& bytes) {
    if (bytes.size() < 10) {
      bytes.append(10, static_cast<char>(Below(256)));
    }
    const std::size_t at = Below(bytes.size());
    switch (Below(6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << Below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(Below(256));
        break;
      case 2:
        bytes.erase(at, 1 + Below(8));
        break;
      case 3:
        bytes.insert(at, bytes.substr(Below(bytes.size()), Below(40)));
        break;
      default:
        PlaceNumber(bytes, Below(bytes.size() - 8));
    }
  }

  void PlaceNumber(std::string& bytes, std::size_t at) {
    using Limits = std::numeric_limits<double>;
    static constexpr std::array<double, 12> kNumbers = {Limits::quiet_NaN(),
                                                        Limits::infinity(),
                                                        -Limits::infinity(),
                                                        Limits::max(),
                                                        Limits::lowest(),
                                                        Limits::denorm_min(),
                                                        0.0,
                                                        -0.0,
                                                        1e9,
                                                        -1e5,
                                                        1.5707963267948966,
                                                        1e-300};
    const double number = kNumbers[Below(kNumbers.size())];
    std::memcpy(bytes.data() + at, &number, sizeof number);
  }

  std::mt19937_64 random_;
};

}  // namespace lambdajet::test
