// Plays a kept corpus, and seeded mutations of it, through one fuzz target: the slice of fuzzing that every test run does.
//
// replay FOLDER MUTATIONS: every file as it is, then so many mutations of each. An input that breaks a promise is left in
// the file `broken_input` of the working folder.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.hpp"

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes ReadAll(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

const Bytes* playing = nullptr;

// Leaves the input that broke something behind; only calls that a signal handler may make.
void KeepInput(int number) {
  const int file = open("broken_input", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0 && playing != nullptr) {
    const auto written = write(file, playing->data(), playing->size());
    (void)written;
  }
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void Play(const Bytes& input) {
  playing = &input;
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

// One to four cuts, copies, flips or numbers that programs trip over.
Bytes Mutate(Bytes input, const Bytes& other, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  static const double kNumbers[] = {0.0,
                                    -0.0,
                                    -1.0,
                                    1e300,
                                    -1e300,
                                    1e-320,
                                    std::numeric_limits<double>::infinity(),
                                    std::numeric_limits<double>::quiet_NaN()};
  for (std::size_t n = 1 + below(4); n > 0; --n) {
    const std::size_t at = below(input.size());
    switch (below(6)) {
      case 0:
        if (!input.empty()) input[at] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 1:
        if (!input.empty()) input[at] = static_cast<std::uint8_t>(random());
        break;
      case 2:
        input.erase(input.begin() + static_cast<long>(at),
                    input.begin() + static_cast<long>(std::min(input.size(), at + below(16))));
        break;
      case 3:
        input.insert(input.begin() + static_cast<long>(at), other.begin(),
                     other.begin() + static_cast<long>(below(other.size())));
        break;
      case 4:
        input.resize(at);
        break;
      default:
        if (input.size() >= at + sizeof(double)) {
          const auto* number = reinterpret_cast<const std::uint8_t*>(&kNumbers[below(std::size(kNumbers))]);
          std::copy_n(number, sizeof(double), input.begin() + static_cast<long>(at));
        }
    }
  }
  if (input.size() > 1u << 16) {
    input.resize(1u << 16);
  }
  return input;
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    std::fprintf(stderr, "usage: replay FOLDER MUTATIONS\n");
    return 2;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(words[1])) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());  // so that a seed gives the same mutations everywhere
  std::vector<Bytes> corpus;
  for (const auto& file : files) {
    corpus.push_back(ReadAll(file));
  }
  if (corpus.empty()) {
    std::fprintf(stderr, "no corpus in %s\n", words[1]);
    return 1;
  }
  for (const int number : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) {
    std::signal(number, KeepInput);
  }
  std::mt19937_64 random(1);
  const long mutations = std::atol(words[2]);
  for (const Bytes& input : corpus) {
    Play(input);
    for (long i = 0; i < mutations; ++i) {
      Play(Mutate(input, corpus[random() % corpus.size()], random));
    }
  }
  std::printf("%zu inputs and %ld mutations of each\n", corpus.size(), mutations);
  return 0;
}
