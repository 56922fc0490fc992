// Too little memory is told as that, whatever the library was at: under limits of the address space, and with an
// allocator that fails at one call after another. A program of its own, since it takes the place of malloc.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <link.h>
#include <sys/resource.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <maquette/maquette.hpp>
#include <new>

#include "support/child_process.h"
#include "support/temp_folder.h"

extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
}

namespace {

// Allocations until one fails. Those of ONNX Runtime and of glibc's loader are not counted: some of them are not
// checked.
std::atomic<int> allocations_left{INT_MAX};
std::atomic<bool> fails_for_good{false};  // and not only once
struct Code {
  std::atomic<const char*> begin{nullptr}, end{nullptr};
  bool has(const char* place) const { return place >= begin.load() && place < end.load(); }
} onnxruntime, loader;

bool fails(const void* caller) {
  if (allocations_left.load(std::memory_order_relaxed) == INT_MAX) return false;
  const char* const at = static_cast<const char*>(caller);
  if (onnxruntime.has(at) || loader.has(at)) return false;
  const int left = allocations_left.fetch_sub(1) - 1;
  if (left > 0) return false;
  if (!fails_for_good && left < 0) return false;
  errno = ENOMEM;
  return true;
}

}  // namespace

#define CALLER __builtin_return_address(0)

extern "C" {
void* malloc(size_t size) { return fails(CALLER) ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return fails(CALLER) ? nullptr : __libc_calloc(count, size); }
void* realloc(void* memory, size_t size) { return fails(CALLER) ? nullptr : __libc_realloc(memory, size); }
void* memalign(size_t alignment, size_t size) { return fails(CALLER) ? nullptr : __libc_memalign(alignment, size); }
void* aligned_alloc(size_t alignment, size_t size) {
  return fails(CALLER) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) {
  if (fails(CALLER)) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
}

// Replaced so that the caller is who asked, not the C++ library; never inlined, since the caller is what counts.
#define NEVER_INLINED __attribute__((noinline))
NEVER_INLINED void* operator new(size_t size) {
  if (void* memory = fails(CALLER) ? nullptr : __libc_malloc(size)) return memory;
  throw std::bad_alloc();
}
NEVER_INLINED void* operator new[](size_t size) {
  if (void* memory = fails(CALLER) ? nullptr : __libc_malloc(size)) return memory;
  throw std::bad_alloc();
}
NEVER_INLINED void* operator new(size_t size, std::align_val_t alignment) {
  if (void* memory = fails(CALLER) ? nullptr : __libc_memalign(size_t(alignment), size)) return memory;
  throw std::bad_alloc();
}
NEVER_INLINED void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
NEVER_INLINED void operator delete(void* memory) noexcept { std::free(memory); }
NEVER_INLINED void operator delete[](void* memory) noexcept { std::free(memory); }
NEVER_INLINED void operator delete(void* memory, size_t) noexcept { std::free(memory); }
NEVER_INLINED void operator delete[](void* memory, size_t) noexcept { std::free(memory); }

namespace {

constexpr char kTinyBundle[] = MAQ_TEST_DATA "/tiny_bundle";

void find_uncounted_code() {
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void*) {
        Code* const code = std::strstr(info->dlpi_name, "onnxruntime") != nullptr ? &onnxruntime
                           : std::strstr(info->dlpi_name, "ld-linux") != nullptr  ? &loader
                                                                                  : nullptr;
        if (code == nullptr) return 0;
        for (int i = 0; i < info->dlpi_phnum; ++i) {
          const ElfW(Phdr)& part = info->dlpi_phdr[i];
          if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
          code->begin = reinterpret_cast<const char*>(info->dlpi_addr + part.p_vaddr);
          code->end = code->begin + part.p_memsz;
        }
        return 0;
      },
      nullptr);
}

maq_densepose_config one_thread() {
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = kTinyBundle;
  config.model.threads = 1;
  return config;
}

// Runs `call` with the first, the second, … allocation failing, that one alone and all after it, later ones at growing
// distances to take less time, until it works without, and expects MAQ_ERROR_OUT_OF_MEMORY with a sentence about memory
// every time that it fails.
class FailingAllocations {
 public:
  // To be called before the first allocation that may fail.
  void begin() const {
    fails_for_good = for_good_;
    allocations_left = n_;
  }

  void run(const std::function<maq_status(const FailingAllocations&)>& call) {
    find_uncounted_code();
    int failed = 0, wrong = 0;
    for (n_ = 1; wrong < 5; n_ += 1 + n_ / 16) {
      int left = 0;
      for (const bool for_good : {false, true}) {
        for_good_ = for_good;
        maq_context_create(0, nullptr, nullptr);  // an error whose text is not that of the next
        const maq_status status = call(*this);
        left = allocations_left.exchange(INT_MAX);
        if (status == MAQ_OK) continue;
        ++failed;
        const std::string text = maq_last_error(nullptr);
        if (status == MAQ_ERROR_OUT_OF_MEMORY && text.find("emory") != std::string::npos) continue;
        ++wrong;
        ADD_FAILURE() << "Allocation " << n_ << (for_good ? " and all after it: " : ": ") << maq_status_get_name(status)
                      << ", " << text;
      }
      if (left > 0) break;
    }
    EXPECT_GT(failed, 0);
  }

 private:
  int n_ = 1;
  bool for_good_ = false;
};

TEST(MemoryLimits, AContextThatCannotBeMadeIsOutOfMemory) {
  FailingAllocations().run([](const FailingAllocations& failing) {
    maq_context* context = nullptr;
    failing.begin();
    const maq_status status = maq_context_create(MAQ_HEADER_VERSION, nullptr, &context);
    maq_context_destroy(context);
    return status;
  });
}

// Starts ONNX Runtime twice, the first time with one failing allocation, its own counted too. Run by the next test in a
// process of its own, since it starts once in a process.
TEST(MemoryLimits, DISABLED_StartTwice) {
  const maquette::Context context;
  const char *version = nullptr, *path = nullptr;
  const auto start = [&] { return maq_context_get_onnxruntime(context.get(), &version, &path); };
  allocations_left = std::atoi(std::getenv("MAQ_TEST_FAILS"));
  const maq_status first = start();
  allocations_left = INT_MAX;
  const std::string said = maq_status_get_name(first) + std::string(" ") + maq_status_get_name(start());
  ASSERT_EQ(write(std::atoi(std::getenv("MAQ_TEST_PIPE")), said.data(), said.size()), ssize_t(said.size()));
}

TEST(MemoryLimits, OnnxRuntimeStartsAgainAfterItsMemoryFailed) {
  int started_again = 0;
  for (const int n : {40, 200, 1000, 3000, 9000, 20000, 30000, 40000}) {
    const ChildOutcome outcome = run_in_child([&](int pipe) {
      setenv("MAQ_TEST_FAILS", std::to_string(n).c_str(), 1);
      setenv("MAQ_TEST_PIPE", std::to_string(pipe).c_str(), 1);
      if (std::freopen("/dev/null", "w", stdout) == nullptr) return 1;
      return execl("/proc/self/exe", "limits", "--gtest_filter=MemoryLimits.DISABLED_StartTwice",
                   "--gtest_also_run_disabled_tests", nullptr);
    });
    if (outcome.trouble != "")
      continue;  // some allocations ONNX Runtime does not check (docs/reference/reliability.md)
    const std::string second = outcome.said.substr(outcome.said.find(' ') + 1);
    EXPECT_EQ(second, "MAQ_OK") << n << ": " << outcome.said;
    started_again += outcome.said.rfind("MAQ_OK", 0) != 0;
  }
  EXPECT_GT(started_again, 0);
}

// Opens a source and takes frames from it.
maq_status take_frames(const maquette::Context& context, const char* uri, int frames) {
  maq_source* source = nullptr;
  maq_status status = maq_source_create(context.get(), uri, nullptr, &source);
  for (int i = 0; i < frames && status == MAQ_OK; ++i) {
    maq_frame* frame = nullptr;
    status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
    maq_frame_release(frame);
  }
  maq_source_destroy(source);
  return status;
}

TEST(MemoryLimits, AStubIsOutOfMemory) {
  const maquette::Context context;
  FailingAllocations().run([&](const FailingAllocations& failing) {
    failing.begin();
    return take_frames(context, "stub:pattern?size=160x120", 2);
  });
  // Decodes a JPEG image.
  FailingAllocations().run([&](const FailingAllocations& failing) {
    failing.begin();
    return take_frames(context, "stub:people?size=160x120", 1);
  });
}

TEST(MemoryLimits, ALiveSourceIsOutOfMemoryAlsoOnItsThread) {
  const maquette::Context context;
  FailingAllocations().run([&](const FailingAllocations& failing) {
    failing.begin();
    return take_frames(context, "stub:pattern?live=1&fps=1000&size=64x48", 3);
  });
}

TEST(MemoryLimits, ADensePoseModelIsOutOfMemoryWhileItIsMade) {
  const maquette::Context context;
  context.onnxruntime_version();
  const maq_densepose_config config = one_thread();
  FailingAllocations().run([&](const FailingAllocations& failing) {
    maq_densepose* densepose = nullptr;
    failing.begin();
    const maq_status status = maq_densepose_create(context.get(), &config, &densepose);
    maq_densepose_destroy(densepose);
    return status;
  });
}

TEST(MemoryLimits, ARunIsOutOfMemoryAndTheNextRunWorks) {
  const maquette::Context context;
  context.onnxruntime_version();
  maquette::Source source(context, "stub:people?size=160x120");
  const maquette::Frame frame = *source.next();
  maquette::DensePose densepose(context, one_thread());
  FailingAllocations().run([&](const FailingAllocations& failing) {
    maq_densepose_result* result = nullptr;
    failing.begin();
    const maq_status status = maq_densepose_run(densepose.get(), frame.get(), &result);
    maq_densepose_result_release(result);
    return status;
  });
  EXPECT_NO_THROW(densepose.run(frame));
}

TEST(MemoryLimits, ACaptureAndARecordingAreOutOfMemoryWhileTheirJsonIsRead) {
  const TempFolder folder;
  const std::string uri = "rec:" + folder.file("a.maqrec");
  const maquette::Context context;
  {
    maquette::Source source(context, "stub:pattern?size=16x16&frames=1");
    maquette::Recorder recorder(context, folder.file("a.maqrec"), &source);
    recorder.add(*source.next());
    recorder.finish();
  }
  FailingAllocations().run([&](const FailingAllocations& failing) {
    failing.begin();
    return take_frames(context, uri.c_str(), 1);
  });
  FailingAllocations().run([&](const FailingAllocations& failing) {
    maq_capture* capture = nullptr;
    failing.begin();
    const maq_status status = maq_capture_open(context.get(), MAQ_TEST_DATA "/tiny_scene/capture", &capture);
    maq_capture_destroy(capture);
    return status;
  });
}

TEST(MemoryLimits, FilesOfAResultAreOutOfMemory) {
  const TempFolder folder;
  const maquette::Context context;
  maquette::Source source(context, "stub:people?size=160x120");
  maquette::DensePose densepose(context, one_thread());
  const maquette::DensePoseResult result = densepose.run(*source.next());
  result.save(folder.file("a"));  // opens the codecs: glibc's loader ends the process where its memory fails
  const std::string path = folder.file("a");
  FailingAllocations().run([&](const FailingAllocations& failing) {
    failing.begin();
    return maq_densepose_result_save(result.get(), path.c_str());
  });
}

TEST(MemoryLimits, APipelineIsOutOfMemoryAndEnds) {
  const maquette::Context context;
  context.onnxruntime_version();
  const maq_densepose_config densepose = one_thread();
  maq_pipeline_config config = maquette::default_pipeline_config();
  FailingAllocations().run([&](const FailingAllocations& failing) {
    maq_pipeline* pipeline = nullptr;
    maq_model* model = nullptr;
    failing.begin();
    maq_status status = maq_pipeline_create(context.get(), &config, &pipeline);
    if (status == MAQ_OK) status = maq_densepose_model_create(context.get(), &densepose, &model);
    if (status == MAQ_OK) status = maq_pipeline_set_model(pipeline, model);
    if (status == MAQ_OK) status = maq_pipeline_set_source(pipeline, "stub:people?size=160x120");
    maq_pipeline_result* result = nullptr;
    if (status == MAQ_OK) status = maq_pipeline_acquire_result(pipeline, MAQ_WAIT_FOREVER, &result);
    maq_pipeline_result_release(result);
    maq_model_destroy(model);
    maq_pipeline_destroy(pipeline);
    return status;
  });
}

// The whole way from a file to files, as an app goes it, with so much address space. On one thread: ONNX Runtime does
// not check every allocation of its own threads, and may hang or crash where one of them fails.
ChildOutcome run_within(rlim_t mebibytes, const std::string& uri, const std::string& folder) {
  return run_in_child([&](int pipe) {
    const rlimit limit = {mebibytes << 20, mebibytes << 20};
    if (setrlimit(RLIMIT_AS, &limit) != 0) return 1;
    maq_context* context = nullptr;
    maq_source* source = nullptr;
    maq_densepose* densepose = nullptr;
    maq_frame* frame = nullptr;
    maq_densepose_result* result = nullptr;
    const maq_densepose_config config = one_thread();
    maq_status status = maq_context_create(MAQ_HEADER_VERSION, nullptr, &context);
    if (status == MAQ_OK) status = maq_source_create(context, uri.c_str(), nullptr, &source);
    if (status == MAQ_OK) status = maq_densepose_create(context, &config, &densepose);
    if (status == MAQ_OK) status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
    if (status == MAQ_OK) status = maq_densepose_run(densepose, frame, &result);
    if (status == MAQ_OK) status = maq_densepose_result_save(result, (folder + "/a").c_str());
    const std::string said = std::string(maq_status_get_name(status)) + " " + maq_last_error(nullptr);
    maq_densepose_result_release(result);
    maq_frame_release(frame);
    maq_densepose_destroy(densepose);
    maq_source_destroy(source);
    maq_context_destroy(context);
    return write(pipe, said.data(), said.size()) == ssize_t(said.size()) ? 0 : 2;
  });
}

TEST(MemoryLimits, EachLimitOfTheAddressSpaceIsOutOfMemoryUntilItIsEnough) {
  const TempFolder folder;
  bool is_refused = false, is_done = false;
  for (rlim_t mebibytes = 24; mebibytes <= 2048; mebibytes += mebibytes / 4) {
    const ChildOutcome outcome = run_within(mebibytes, "stub:people?size=640x480", folder.path().string());
    EXPECT_EQ(outcome.trouble, "") << mebibytes << " MiB";
    is_done = outcome.said.rfind("MAQ_OK", 0) == 0;
    const bool tells = outcome.said.rfind("MAQ_ERROR_OUT_OF_MEMORY ", 0) == 0;
    EXPECT_TRUE(is_done || tells) << mebibytes << " MiB: " << outcome.said;
    is_refused = is_refused || tells;
  }
  EXPECT_TRUE(is_refused);
  EXPECT_TRUE(is_done);
}

// How much address space this process has taken.
rlim_t taken_bytes() {
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  return pages * rlim_t(sysconf(_SC_PAGESIZE));
}

// Sets the limit of the address space to so much more than is taken, and takes what was freed before, which malloc
// would use first. For child processes.
bool leave_memory(rlim_t bytes) {
  rlimit limit = {taken_bytes(), RLIM_INFINITY};
  if (setrlimit(RLIMIT_AS, &limit) != 0) return false;
  for (size_t size = 64 << 10; size >= 64; size /= 4) {
    void* volatile memory = nullptr;  // volatile: else the compiler needs none
    do memory = std::malloc(size);
    while (memory != nullptr);
  }
  limit.rlim_cur += bytes;
  return setrlimit(RLIMIT_AS, &limit) == 0;
}

TEST(MemoryLimits, ANetworkIsNotDamagedWhereThereIsTooLittleMemoryForIt) {
  bool is_refused = false;
  // So little that ONNX Runtime does not come to its optimisations, some of whose allocations it does not check.
  for (rlim_t bytes = rlim_t(1) << 20; bytes <= rlim_t(4) << 20; bytes += bytes / 8) {
    const ChildOutcome outcome = run_in_child([&](int pipe) {
      const maquette::Context context;
      context.onnxruntime_version();
      if (!leave_memory(bytes)) return 1;
      const maq_densepose_config config = one_thread();
      maq_densepose* densepose = nullptr;
      const maq_status status = maq_densepose_create(context.get(), &config, &densepose);
      const std::string said = std::string(maq_status_get_name(status)) + " " + maq_last_error(nullptr);
      return write(pipe, said.data(), said.size()) == ssize_t(said.size()) ? 0 : 2;
    });
    EXPECT_EQ(outcome.trouble, "") << bytes << " bytes more";
    const bool tells = outcome.said.rfind("MAQ_ERROR_OUT_OF_MEMORY ", 0) == 0;
    EXPECT_TRUE(tells || outcome.said.rfind("MAQ_OK", 0) == 0) << bytes << " bytes more: " << outcome.said;
    is_refused = is_refused || tells;
  }
  EXPECT_TRUE(is_refused);
}

TEST(MemoryLimits, AFileIsNotDamagedWhereThereIsTooLittleMemoryForIt) {
  // Larger than what malloc may keep in each arena of earlier tests, 64 MiB; written in another process.
  const TempFolder folder;
  const ChildOutcome writing = run_in_child([&](int) {
    const maquette::Context context;
    maquette::Source(context, "stub:pattern?size=6000x4500").next()->save(folder.file("large.png"));
    return 0;
  });
  ASSERT_EQ(writing.trouble, "") << writing.said;
  // Opens the codecs, which take more than the files.
  ASSERT_EQ(take_frames(maquette::Context(), "image:" MAQ_TEST_DATA "/rendered_views/0.png", 1), MAQ_OK);
  bool is_refused = false;
  for (const std::string& uri :
       {"image:" + folder.file("large.png"), std::string("video:" MAQ_TEST_MEDIA "/clip.mp4")}) {
    bool is_done = false;
    for (rlim_t bytes = 256 << 10; bytes <= rlim_t(1) << 30; bytes *= 4) {
      const ChildOutcome outcome = run_in_child([&](int pipe) {
        const rlimit limit = {taken_bytes() + bytes, taken_bytes() + bytes};
        if (setrlimit(RLIMIT_AS, &limit) != 0) return 1;
        const maq_status status = take_frames(maquette::Context(), uri.c_str(), 3);
        const std::string said = std::string(maq_status_get_name(status)) + " " + maq_last_error(nullptr);
        return write(pipe, said.data(), said.size()) == ssize_t(said.size()) ? 0 : 2;
      });
      EXPECT_EQ(outcome.trouble, "") << uri << ", " << bytes << " bytes more";
      // An image has one frame.
      is_done = outcome.said.rfind("MAQ_OK", 0) == 0 || outcome.said.rfind("MAQ_END_OF_STREAM", 0) == 0;
      const bool tells = outcome.said.rfind("MAQ_ERROR_OUT_OF_MEMORY ", 0) == 0;
      EXPECT_TRUE(is_done || tells) << uri << ", " << bytes << " bytes more: " << outcome.said;
      is_refused = is_refused || tells;
    }
    EXPECT_TRUE(is_done) << uri;
  }
  EXPECT_TRUE(is_refused);
}

}  // namespace
