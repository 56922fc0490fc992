// The threads of a session's pool, started before ONNX Runtime asks for them: it hangs where the system gives it
// some of its threads, but not all.
#pragma once

#include <onnxruntime_c_api.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace maq {

class SessionThreads {
 public:
  // Starts `count` threads, or as many as the system gives; none where a limit of the address space is near.
  explicit SessionThreads(int count);
  // Ends threads that were not assigned.
  ~SessionThreads();
  SessionThreads(const SessionThreads&) = delete;
  SessionThreads& operator=(const SessionThreads&) = delete;

  int count() const { return int(waiting_.size()); }
  // Returns why there are fewer threads than requested; empty if there are enough.
  const std::string& shortage() const { return shortage_; }

  // For OrtApi's SessionOptionsSetCustomCreateThreadFn, whose options are this object, and …SetCustomJoinThreadFn.
  // An assigned thread does not need this object any more. Null when all are assigned.
  static OrtCustomThreadHandle assign(void* self, OrtThreadWorkerFn work, void* argument) noexcept;
  static void join(OrtCustomThreadHandle handle) noexcept;

 private:
  SessionThreads() = default;

  struct Worker {
    std::mutex mutex;
    std::condition_variable changed;
    enum { kStarts, kIsReady, kHasNoMemory } state = kStarts;
    bool is_told = false;  // to work, or to end where `work` is null
    OrtThreadWorkerFn work = nullptr;
    void* argument = nullptr;
    std::thread thread;

    void run();
    bool wait_until_ready();  // false where it has no memory
    void tell(OrtThreadWorkerFn work_given, void* argument_given);
    void end();
  };

  std::vector<std::unique_ptr<Worker>> waiting_;
  std::string shortage_;
};

}  // namespace maq
