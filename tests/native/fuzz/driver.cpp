// Runs a fuzz target where there is no libFuzzer (GCC): on changes of its inputs, without a search by reached code.
//
//   MAQ_FUZZ_TARGET=ply fuzz_targets --seconds 2 [--seed 1] FILE_OR_FOLDER...
//
// `--seconds` is processor time. Without it each file is an input, once: to see a crash again. An input that ends the
// program, or takes 20 s, is written to crash-TARGET in the working folder.
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "fuzz_target.h"
#include "mutation.h"

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments);
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
extern "C" __attribute__((weak)) void __sanitizer_set_death_callback(void (*)());

namespace {

constexpr unsigned kHangSeconds = 20;
constexpr size_t kMaxBytes = 1 << 16;

const fuzz::Bytes* current = nullptr;  // NOLINT: what signal handlers can reach

void write_crash() {
  if (current == nullptr) return;
  std::array<char, 256> name;
  std::snprintf(name.data(), name.size(), "crash-%s", std::getenv("MAQ_FUZZ_TARGET"));
  const int file = open(name.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file >= 0 && write(file, current->data(), current->size()) == ssize_t(current->size())) {
    std::fprintf(stderr, "The input is in %s.\n", name.data());
  }
  current = nullptr;
}

void on_signal(int number) {
  std::fprintf(stderr, "Ended by signal %d (%d: more than %u s).\n", number, SIGALRM, kHangSeconds);
  write_crash();
  _exit(70);
}

void run(const fuzz::Bytes& bytes) {
  current = &bytes;
  alarm(kHangSeconds);
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  alarm(0);
  current = nullptr;
}

fuzz::Bytes read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

int main(int count, char** arguments) {
  LLVMFuzzerInitialize(&count, &arguments);
  double seconds = 0;
  uint64_t seed = 1;
  std::vector<fuzz::Bytes> inputs;
  for (int i = 1; i < count; ++i) {
    const std::string name = arguments[i];
    if (name == "--seconds" && i + 1 < count) {
      seconds = std::atof(arguments[++i]);
    } else if (name == "--seed" && i + 1 < count) {
      seed = std::strtoull(arguments[++i], nullptr, 10);
    } else if (std::filesystem::is_directory(name)) {
      for (const auto& entry : std::filesystem::directory_iterator(name)) inputs.push_back(read(entry.path()));
    } else {
      inputs.push_back(read(name));
    }
  }
  for (const int number : {SIGABRT, SIGALRM}) std::signal(number, on_signal);
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(write_crash);
  if (inputs.empty()) inputs.emplace_back(16);
  for (const fuzz::Bytes& bytes : inputs) run(bytes);
  fuzz::Mutator mutator(seed, kMaxBytes);
  size_t runs = inputs.size();
  for (; double(std::clock()) / CLOCKS_PER_SEC < seconds; ++runs) {
    run(mutator.changed(inputs[mutator.below(inputs.size())], inputs[mutator.below(inputs.size())]));
  }
  std::printf("%zu runs\n", runs);
  return 0;
}
