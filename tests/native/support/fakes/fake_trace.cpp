// The tracing functions of libandroid.so, which write down the sections.
#include "support/fakes/fake_trace.h"

#include <atomic>
#include <mutex>
#include <utility>
#include <vector>

#define EXPORTED extern "C" __attribute__((visibility("default")))

namespace {

std::atomic<bool> is_recording{false};
std::mutex mutex;
std::string sections;
thread_local std::vector<std::string> open;

}  // namespace

EXPORTED bool ATrace_isEnabled() { return is_recording; }
EXPORTED void ATrace_beginSection(const char* name) {
  open.emplace_back(name);
  const std::lock_guard<std::mutex> lock(mutex);
  for (size_t i = 1; i < open.size(); ++i) sections += '.';
  sections += std::string(name) + '\n';
}
EXPORTED void ATrace_endSection() {
  const std::lock_guard<std::mutex> lock(mutex);
  if (open.empty()) sections += "an end without a beginning\n";
  if (!open.empty()) open.pop_back();
}

void fake_trace_record(bool records) { is_recording = records; }
std::string fake_trace_sections() {
  const std::lock_guard<std::mutex> lock(mutex);
  return std::exchange(sections, {});
}
