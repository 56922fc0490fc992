// Whether a frame takes memory from the heap once everything runs. A program of its own, since it replaces malloc.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <maquette/maquette.hpp>
#include <new>

#include "support/temp_folder.h"

extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
}

namespace {

// Set while a frame is worked on. What other threads of ONNX Runtime's pool take is counted as well.
std::atomic<bool> counting{false};
thread_local bool looking_up = false;

struct Site {
  std::atomic<void*> caller{nullptr};
  std::atomic<int> count{0};
};
Site sites[256];

void note(void* caller) {
  if (!counting || looking_up) return;
  for (Site& site : sites) {
    void* expected = nullptr;
    if (site.caller.compare_exchange_strong(expected, caller) || expected == caller) {
      ++site.count;
      return;
    }
  }
}

struct Allocations {
  int ours = 0;
  int theirs = 0;  // of ONNX Runtime and libjpeg-turbo themselves
  std::string where;
};

Allocations counted() {
  Allocations found;
  looking_up = true;
  for (Site& site : sites) {
    void* caller = site.caller;
    if (caller == nullptr) break;
    Dl_info info{};
    const char* file = dladdr(caller, &info) != 0 && info.dli_fname != nullptr ? info.dli_fname : "?";
    const bool theirs = std::strstr(file, "onnxruntime") != nullptr || std::strstr(file, "turbojpeg") != nullptr;
    (theirs ? found.theirs : found.ours) += site.count;
    if (!theirs) {
      char text[512];
      std::snprintf(text, sizeof text, "%5d at %s+0x%zx\n", site.count.load(), file,
                    size_t(static_cast<char*>(caller) - static_cast<char*>(info.dli_fbase)));
      found.where += text;
    }
    site.caller = nullptr;
    site.count = 0;
  }
  looking_up = false;
  return found;
}

}  // namespace

extern "C" {
void* malloc(size_t size) {
  note(__builtin_return_address(0));
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
  note(__builtin_return_address(0));
  return __libc_calloc(count, size);
}
void* realloc(void* memory, size_t size) {
  note(__builtin_return_address(0));
  return __libc_realloc(memory, size);
}
void* memalign(size_t alignment, size_t size) {
  note(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  note(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) {
  note(__builtin_return_address(0));
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
}

// Replaced so that the caller is who asked, not the C++ library; never inlined, since the caller is what counts.
#define NEVER_INLINED __attribute__((noinline))
NEVER_INLINED void* operator new(size_t size) {
  note(__builtin_return_address(0));
  if (void* memory = __libc_malloc(size)) return memory;
  throw std::bad_alloc();
}
NEVER_INLINED void* operator new[](size_t size) {
  note(__builtin_return_address(0));
  if (void* memory = __libc_malloc(size)) return memory;
  throw std::bad_alloc();
}
NEVER_INLINED void* operator new(size_t size, std::align_val_t alignment) {
  note(__builtin_return_address(0));
  if (void* memory = __libc_memalign(size_t(alignment), size)) return memory;
  throw std::bad_alloc();
}
NEVER_INLINED void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
NEVER_INLINED void operator delete(void* memory) noexcept { std::free(memory); }
NEVER_INLINED void operator delete[](void* memory) noexcept { std::free(memory); }
NEVER_INLINED void operator delete(void* memory, size_t) noexcept { std::free(memory); }
NEVER_INLINED void operator delete[](void* memory, size_t) noexcept { std::free(memory); }

namespace {

TEST(SteadyState, FramesInTheFormatsOfCamerasTakeNothingFromTheHeap) {
  const maquette::Context context;
  maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
  for (const maq_pixel_format format : {MAQ_PIXEL_YUYV, MAQ_PIXEL_NV12, MAQ_PIXEL_RGB8, MAQ_PIXEL_GREY8}) {
    std::vector<uint8_t> pixels(640 * 480 * 4, 90);
    maq_frame_desc desc;
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = format;
    desc.width_px = 640;
    desc.height_px = 480;
    desc.planes[0] = pixels.data();
    desc.planes[1] = pixels.data() + 640 * 480;
    const maquette::Frame frame(context, desc);
    const auto run = [&] {
      maq_densepose_result* result = nullptr;
      ASSERT_EQ(maq_densepose_run(densepose.get(), frame.get(), &result), MAQ_OK);
      maq_densepose_result_release(result);
    };
    for (int i = 0; i < 5; ++i) run();  // the pool of results
    // A thread of OpenCV's pool may join late and make its notes once; what is taken for each frame is taken in each
    // round.
    Allocations found;
    for (int round = 0; round < 5; ++round) {
      counting = true;
      for (int i = 0; i < 5; ++i) run();
      counting = false;
      found = counted();
      if (found.ours == 0) break;
    }
    EXPECT_EQ(found.ours, 0) << "format " << format << "\n" << found.where;
  }
}

TEST(SteadyState, DepthFramesTakeNothingFromTheHeap) {
  const maquette::Context context;
  for (const int32_t skip_planes : {0, 1}) {
    maq_edges_config config = maquette::default_edges_config();
    config.model.bundle_path = MAQ_TEST_DATA "/tiny_edges/bundle";
    config.skip_planes = skip_planes;
    config.average_frames = 8;
    maquette::Edges edges(context, config);
    maquette::Source source(context, "stub:solids?scene=box&noise=tof");
    std::vector<maquette::Frame> frames;
    for (int i = 0; i < 3; ++i) frames.push_back(std::move(*source.next()));
    const auto run = [&](int count) {
      for (int i = 0; i < count; ++i) {
        maq_edges_result* result = nullptr;
        ASSERT_EQ(maq_edges_run(edges.get(), frames[size_t(i) % 3].get(), &result), MAQ_OK);
        maq_edges_result_release(result);
      }
    };
    run(6);
    counting = true;
    run(30);
    counting = false;
    const Allocations found = counted();
    EXPECT_EQ(found.ours, 0) << "skip_planes " << skip_planes << "\n" << found.where;
    std::printf("ONNX Runtime itself: %.1f allocations a depth frame\n", found.theirs / 30.0);
  }
}

TEST(SteadyState, BodiesTakeNothingFromTheHeap) {
  const maquette::Context context;
  maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
  maquette::Source source(context, "image:" MAQ_TEST_MEDIA "/photo.jpg");
  const maquette::Frame frame = std::move(*source.next());
  const maquette::DensePoseResult people = densepose.run(frame);
  maq_body_config config = maquette::default_body_config();
  config.model.bundle_path = MAQ_TEST_MODELS "/body";
  maquette::Body body(context, config);
  maq_body_input input = maquette::default_body_input();
  input.width_px = people.width_px(), input.height_px = people.height_px();
  const uint8_t** const planes[] = {&input.part, &input.u, &input.v, &input.person};
  for (int32_t i = 0; i < 4; ++i) {
    const auto plane = maq_densepose_plane(MAQ_DENSEPOSE_PLANE_PART + i);
    ASSERT_EQ(maq_densepose_result_get_plane(people.get(), plane, planes[i], &input.stride_bytes), MAQ_OK);
  }
  input.person_count = 1;
  const int64_t id = 1;
  input.ids = &id;
  const auto run = [&](int count) {
    for (int i = 0; i < count; ++i) {
      input.timestamp_ns += i % 4 == 3 ? 2'000'000'000 : 33'000'000;  // also starts without a frame before
      maq_body_result* result = nullptr;
      ASSERT_EQ(maq_body_run(body.get(), &input, &result), MAQ_OK);
      maq_body_result_release(result);
    }
  };
  run(6);
  counting = true;
  run(12);
  counting = false;
  const Allocations found = counted();
  EXPECT_EQ(found.ours, 0) << found.where;
}

TEST(SteadyState, PredictedFramesTakeNothingFromTheHeap) {
  const maquette::Context context;
  for (const maq_predictor_method method : {MAQ_PREDICTOR_AUTO, MAQ_PREDICTOR_MOTION}) {
    maq_predictor_config config = maquette::default_predictor_config();
    config.method = method;
    config.model.threads = 2;
    maquette::Predictor predictor(context, config);
    config.model.threads = 1;
    maquette::Predictor other(context, config);  // whose frames are smaller, in the same memory
    maquette::Source source(context, "stub:people?count=2&size=320x240&fps=30");
    std::vector<maquette::Frame> frames;
    for (int i = 0; i < 4; ++i) frames.push_back(std::move(*source.next()));
    std::vector<uint8_t> pixels(320 * 240 * 3);
    maq_frame_desc desc = frames[0].desc();
    int64_t time_ns = 0;
    const auto run = [&](int count) {
      for (int i = 0; i < count; ++i) {
        frames[size_t(i) % 4].copy_pixels(MAQ_PIXEL_BGR8, pixels.data(), 0, pixels.size());
        desc.planes[0] = pixels.data();
        desc.stride_bytes[0] = 0;
        desc.timestamp_ns = time_ns += 33333333;
        const maquette::Frame frame(context, desc);
        maq_frame_desc part = desc;
        part.stride_bytes[0] = 320 * 3;
        part.width_px = 100;
        part.height_px = 60;
        const maquette::Frame smaller(context, part);
        counting = true;
        for (const auto& [stream, shown] : {std::pair{&predictor, &frame}, {&other, &smaller}}) {
          ASSERT_EQ(maq_predictor_push(stream->get(), shown->get()), MAQ_OK);
          maq_frame* predicted = nullptr;
          ASSERT_EQ(maq_predictor_predict(stream->get(), 0.1, &predicted), MAQ_OK);
          maq_frame_release(predicted);
        }
        counting = false;
      }
    };
    run(40);  // until every memory of past frames was filled
    counted();
    run(30);
    const Allocations found = counted();
    EXPECT_EQ(found.ours, 0) << "method " << method << "\n" << found.where;
  }
}

TEST(SteadyState, ACheckOfTheCameraTakesNothingFromTheHeap) {
  const maquette::Context context;
  const maquette::CameraHealth health(context);
  maquette::Source source(context, "stub:people?count=2&size=320x240&fps=30");
  maquette::Source other(context, "stub:pattern?size=320x240&fps=30");
  std::vector<maquette::Frame> frames;
  for (int i = 0; i < 3; ++i) frames.push_back(std::move(*source.next()));
  for (int i = 0; i < 3; ++i) frames.push_back(std::move(*other.next()));
  std::vector<float> map(1000);
  const auto run = [&](int count) {
    for (int i = 0; i < count; ++i) {
      maq_camera_health_result result{};
      result.struct_size = sizeof result;
      // Cuts from one scene to the other.
      const maquette::Frame& frame = frames[size_t(i % 3 + i / 20 % 2 * 3)];
      ASSERT_EQ(maq_camera_health_push(health.get(), frame.get(), &result), MAQ_OK);
      ASSERT_EQ(maq_camera_health_copy_map(health.get(), map.data(), map.size()), MAQ_OK);
    }
  };
  run(60);
  counting = true;
  run(60);
  counting = false;
  const Allocations found = counted();
  EXPECT_EQ(found.ours, 0) << found.where;
}

// Through the thread, the queue and the status callback of a camera; a recording stands in for the device.
TEST(SteadyState, FramesOfLiveSourcesTakeNothingFromTheHeap) {
  const TempFolder folder;
  const std::string path = folder.file("a.maqrec");
  const maquette::Context context;
  {
    maquette::Source stub(context, "stub:people?size=160x120&frames=400");
    maq_recorder_config config;
    maq_recorder_config_init(&config, sizeof config);
    config.jpeg_quality = 90;
    maquette::Recorder recorder(context, path, &stub, &config);
    while (const auto frame = stub.next()) recorder.add(*frame);
    recorder.finish();
  }
  for (const std::string& uri :
       {std::string("stub:pattern?live=1&fps=300&size=160x120"),
        std::string("stub:people?fps=300&size=160x120&drop=0.2&jitter=3ms"), "rec:" + path + "?live=1&speed=10"}) {
    maq_source_config config = maquette::default_source_config();
    config.queue_length = 3;
    maquette::Source source(context, uri, &config);
    const auto take = [&](int frames) {
      for (int i = 0; i < frames; ++i) {
        maq_frame* frame = nullptr;
        ASSERT_EQ(maq_source_acquire_frame(source.get(), 10000000000, &frame), MAQ_OK) << maq_last_error(source.get());
        maq_frame_release(frame);
      }
    };
    take(50);  // every buffer was filled once
    counting = true;
    take(100);
    counting = false;
    const Allocations found = counted();
    EXPECT_EQ(found.ours, 0) << uri << "\n" << found.where;
    if (found.theirs > 0) std::printf("libjpeg-turbo itself: %.1f allocations a frame\n", found.theirs / 100.0);
  }
}

TEST(SteadyState, AFrameTakesNothingFromTheHeap) {
  const maquette::Context context;
  maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
  constexpr int kFrames = 60;
  int people = 0;
  const auto run = [&](maquette::Source& source, int frames) {
    for (int i = 0; i < frames; ++i) {
      maq_frame* frame = nullptr;
      maq_densepose_result* result = nullptr;
      maq_densepose_person found{};
      found.struct_size = sizeof found;
      ASSERT_EQ(maq_source_acquire_frame(source.get(), MAQ_WAIT_FOREVER, &frame), MAQ_OK);
      ASSERT_EQ(maq_densepose_run(densepose.get(), frame, &result), MAQ_OK);
      const uint32_t count = maq_densepose_result_get_person_count(result);
      for (uint32_t k = 0; k < count; ++k) {
        ASSERT_EQ(maq_densepose_result_get_person(result, k, &found), MAQ_OK);
      }
      people += int(count);
      maq_densepose_result_release(result);
      maq_frame_release(frame);
    }
  };
  // Twice the same frames: a person larger than all before may take more memory, but only once.
  maquette::Source source(context, "stub:people?count=3"), again(context, "stub:people?count=3");
  run(source, kFrames);
  run(again, 1);  // makes the one frame of its pool that is needed
  people = 0;
  counting = true;
  run(again, kFrames - 1);
  counting = false;
  const Allocations found = counted();
  EXPECT_GT(people, kFrames) << "people must be there, or heads never ran";
  EXPECT_EQ(found.ours, 0) << found.where;
  std::printf("ONNX Runtime itself: %.1f allocations a frame\n", found.theirs / double(kFrames - 1));
}

}  // namespace
