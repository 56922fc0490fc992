#include "nn/session_threads.h"

#include <algorithm>
#include <cstdlib>

#include "core/memory.h"
#include "core/thread.h"

namespace maq {
namespace {

// Networks and frames of common sizes need less.
constexpr size_t kMinAddressSpace = size_t(1) << 30;

}  // namespace

void SessionThreads::Worker::run() {
  // Kept until ONNX Runtime's thread-local storage can take its place.
  std::unique_ptr<void, decltype(&std::free)> room(std::malloc(kThreadLocalBytes), &std::free);
  {
    std::unique_lock<std::mutex> lock(mutex);
    state = room == nullptr ? kHasNoMemory : kIsReady;
    changed.notify_one();
    changed.wait(lock, [this] { return is_told; });
  }
  room.reset();
  if (work != nullptr) work(argument);
}

bool SessionThreads::Worker::wait_until_ready() {
  std::unique_lock<std::mutex> lock(mutex);
  changed.wait(lock, [this] { return state != kStarts; });
  return state == kIsReady;
}

void SessionThreads::Worker::tell(OrtThreadWorkerFn work_given, void* argument_given) {
  std::lock_guard<std::mutex> lock(mutex);
  work = work_given;
  argument = argument_given;
  is_told = true;
  changed.notify_one();
}

void SessionThreads::Worker::end() {
  tell(nullptr, nullptr);
  thread.join();
}

SessionThreads::SessionThreads(int count) : SessionThreads() {  // so an exception here ends the started threads
  if (count > 0 && address_space_left() < kMinAddressSpace) {
    shortage_ = concatenate("The process may take less than ", kMinAddressSpace >> 20,
                            " MiB more (ulimit -v), and ONNX Runtime hangs where memory ends on several threads.");
    return;
  }
  waiting_.reserve(size_t(count));
  try {
    while (this->count() < count) {
      auto worker = std::make_unique<Worker>();
      worker->thread = start_thread("maq network", [self = worker.get()] { self->run(); });
      waiting_.push_back(std::move(worker));
    }
  } catch (const Error& error) {
    shortage_ = error.what();
  }
  const auto ready =
      std::partition(waiting_.begin(), waiting_.end(), [&](const auto& worker) { return worker->wait_until_ready(); });
  if (ready == waiting_.end()) return;
  for (auto worker = ready; worker != waiting_.end(); ++worker) (*worker)->end();
  waiting_.erase(ready, waiting_.end());
  shortage_ = kNoMemory;
}

SessionThreads::~SessionThreads() {
  for (const auto& worker : waiting_) worker->end();
}

OrtCustomThreadHandle SessionThreads::assign(void* self, OrtThreadWorkerFn work, void* argument) noexcept {
  auto& waiting = static_cast<SessionThreads*>(self)->waiting_;
  if (waiting.empty()) return nullptr;
  Worker* const worker = waiting.back().release();
  waiting.pop_back();
  worker->tell(work, argument);
  return reinterpret_cast<OrtCustomThreadHandle>(worker);
}

void SessionThreads::join(OrtCustomThreadHandle handle) noexcept {
  const std::unique_ptr<Worker> worker(reinterpret_cast<Worker*>(const_cast<OrtCustomHandleType*>(handle)));
  worker->thread.join();
}

}  // namespace maq
