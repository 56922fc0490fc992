#include "open_sources.h"

#include <algorithm>
#include <mutex>
#include <vector>

#include "interrupt.h"

namespace {

// Never destroyed: the thread that looks through it may outlive main().
struct OpenSources {
  std::mutex mutex;
  std::vector<maq_source*> all;
};
OpenSources& open_sources() {
  static auto* sources = new OpenSources;
  return *sources;
}

}  // namespace

void stop_open_sources() {
  const std::lock_guard<std::mutex> lock(open_sources().mutex);
  for (maq_source* source : open_sources().all) maq_source_stop(source);
}

StoppedByInterrupt::StoppedByInterrupt(const maquette::Source& source) : source_(source.get()) {
  const std::lock_guard<std::mutex> lock(open_sources().mutex);
  open_sources().all.push_back(source_);
  if (interrupted()) maq_source_stop(source_);
}

StoppedByInterrupt::~StoppedByInterrupt() {
  const std::lock_guard<std::mutex> lock(open_sources().mutex);
  std::vector<maq_source*>& all = open_sources().all;
  all.erase(std::remove(all.begin(), all.end(), source_), all.end());
}
