#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <maquette/maquette.hpp>
#include <mutex>
#include <thread>
#include <vector>

#include "support/temp_folder.h"

namespace {

using namespace std::chrono_literals;

const std::string kTinyBundle = MAQ_TEST_DATA "/tiny_bundle";
constexpr auto kLongEnough = 60s;  // for anything, on a machine with other work

maq_densepose_config densepose_config(const std::string& bundle = kTinyBundle) {
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = bundle.c_str();
  config.model.threads = 1;
  return config;
}

// A pipeline and what came from it.
class Watched {
 public:
  struct Options {
    bool polls = false, real_time = false, loop = false;
    int reconnect_ms = 30000, stall_ms = 2000;
    uint32_t pool_size = 4;
    double frame_budget_ms = 0;
    std::string bundle = kTinyBundle;
    std::function<void(const maquette::PipelineResult&)> on_result;
    std::function<void(maq_pipeline_state)> on_state;
  };

  explicit Watched(Options given) : options(std::move(given)) {
    maq_source_config source = maquette::default_source_config();
    source.real_time = options.real_time ? 1 : 0;
    source.loop = options.loop ? 1 : 0;
    source.reconnect_ms = options.reconnect_ms;
    source.stall_ms = options.stall_ms;
    maq_pipeline_config config = maquette::default_pipeline_config();
    config.source = &source;
    config.result_pool_size = options.pool_size;
    config.result_user_data = config.state_user_data = this;
    if (!options.polls) {
      config.result_callback = [](void* self, maq_pipeline_result* result) {
        static_cast<Watched*>(self)->take(maquette::PipelineResult(result));
      };
    }
    config.state_callback = [](void* self, maq_pipeline_state state, maq_status, const char*) {
      static_cast<Watched*>(self)->take_state(state);
    };
    pipeline.emplace(context, config);
    set_model(densepose_config(options.bundle));
  }
  ~Watched() { pipeline.reset(); }

  void set_model(const maq_densepose_config& config) {
    model.emplace(context, config);
    model->set_frame_budget(options.frame_budget_ms);
    pipeline->set_model(*model);
  }

  // Looks again after each result and change of state, and every few milliseconds.
  template <class Condition>
  bool until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + kLongEnough;
    while (std::chrono::steady_clock::now() < end) {
      if (condition()) return true;
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait_for(lock, 5ms);
    }
    return condition();
  }
  bool until_state(maq_pipeline_state state) {
    return until([&] { return pipeline->info().state == state; });
  }

  size_t count() const { return sequences().size(); }
  std::vector<uint64_t> sequences() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return sequences_;
  }
  std::vector<int> widths() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return widths_;
  }
  std::vector<maq_pipeline_state> states() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return states_;
  }

  bool saw(maq_pipeline_state state) const {
    const std::vector<maq_pipeline_state> all = states();
    return std::find(all.begin(), all.end(), state) != all.end();
  }
  void forget_states() {
    std::lock_guard<std::mutex> lock(mutex_);
    states_.clear();
  }

  Options options;
  maquette::Context context;
  std::optional<maquette::Pipeline> pipeline;
  std::optional<maquette::DensePoseModel> model;

 private:
  void take(const maquette::PipelineResult& result) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      sequences_.push_back(result.frame.desc().sequence);
      widths_.push_back(result.frame.desc().width_px);
      EXPECT_EQ(maquette::densepose_of(result).width_px(), widths_.back());
      EXPECT_GT(result.number, last_number_);
      last_number_ = result.number;
    }
    changed_.notify_all();
    if (options.on_result) options.on_result(result);
  }
  void take_state(maq_pipeline_state state) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      states_.push_back(state);
    }
    changed_.notify_all();
    if (options.on_state) options.on_state(state);
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<uint64_t> sequences_;
  std::vector<int> widths_;
  std::vector<maq_pipeline_state> states_;
  uint64_t last_number_ = 0;
};

Watched::Options polling(bool real_time) {
  Watched::Options options;
  options.polls = true;
  options.real_time = real_time;
  return options;
}

// Has it load its model, so that what happens to the next camera does not happen meanwhile; then forgets its states.
void load_model(Watched& watched) {
  watched.pipeline->set_source("stub:pattern?frames=1&size=32x32");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  watched.pipeline->stop();
  watched.forget_states();
}

maq_status status_of_next(maquette::Pipeline& pipeline, int64_t timeout_ns = MAQ_WAIT_FOREVER) {
  maq_pipeline_result* result = nullptr;
  const maq_status status = maq_pipeline_acquire_result(pipeline.get(), timeout_ns, &result);
  EXPECT_EQ(maq_pipeline_result_get_frame(result) != nullptr, status == MAQ_OK);
  maq_pipeline_result_release(result);
  return status;
}

TEST(Pipeline, GivesEveryFrameOfAClipToACallbackInOrder) {
  Watched watched({});
  watched.pipeline->set_source("stub:pattern?frames=7&size=64x48");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.sequences(), (std::vector<uint64_t>{0, 1, 2, 3, 4, 5, 6}));
  ASSERT_TRUE(watched.until([&] { return watched.states().size() == 4; }));
  EXPECT_EQ(watched.states(), (std::vector<maq_pipeline_state>{MAQ_PIPELINE_OPENING, MAQ_PIPELINE_LOADING,
                                                               MAQ_PIPELINE_RUNNING, MAQ_PIPELINE_ENDED}));
  EXPECT_EQ(watched.pipeline->stats().result_count, 7u);
  EXPECT_EQ(watched.pipeline->stats().dropped_result_count, 0u);
  EXPECT_EQ(watched.pipeline->info().status, MAQ_OK);
  EXPECT_STREQ(watched.pipeline->info().source_uri, "stub:pattern?frames=7&size=64x48");
}

TEST(Pipeline, ACallerThatPollsGetsTheLastResultAndThenTheEnd) {
  Watched watched(polling(false));
  watched.pipeline->set_source("stub:pattern?frames=7&size=64x48");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  const std::optional<maquette::PipelineResult> last = watched.pipeline->next();
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->number, 7u);
  EXPECT_EQ(last->frame.desc().sequence, 6u);
  EXPECT_EQ(maquette::densepose_of(*last).width_px(), 64);
  EXPECT_GE(last->wait_ms, 0);
  EXPECT_GT(last->run_ms, 0);
  EXPECT_EQ(last->age_ms, -1) << "of a file nothing is known";
  EXPECT_FALSE(watched.pipeline->next().has_value());
  EXPECT_EQ(watched.pipeline->stats().dropped_result_count, 6u);
}

TEST(Pipeline, TheNewestResultWinsWhenTheCallerIsSlow) {
  Watched watched(polling(true));
  watched.pipeline->set_source("stub:pattern?fps=100&size=32x32");
  const uint64_t first = watched.pipeline->next()->number;
  ASSERT_TRUE(watched.until([&] { return watched.pipeline->stats().result_count >= first + 5; }));
  const std::optional<maquette::PipelineResult> newest = watched.pipeline->next();
  EXPECT_GE(newest->number, first + 5);
  EXPECT_GE(newest->age_ms, 0);
  EXPECT_GE(watched.pipeline->stats().dropped_result_count, 4u);
  EXPECT_GT(watched.pipeline->stats().results_per_second, 0);
}

TEST(Pipeline, FramesAreDroppedWhileAModelIsSlow) {
  Watched::Options options;
  options.real_time = true;
  options.on_result = [](const maquette::PipelineResult&) { std::this_thread::sleep_for(100ms); };
  Watched watched(options);
  watched.pipeline->set_source("stub:pattern?fps=100&size=32x32");
  ASSERT_TRUE(watched.until([&] { return watched.count() >= 4; }));
  const std::vector<uint64_t> sequences = watched.sequences();
  for (size_t i = 1; i < 4; ++i) EXPECT_GT(sequences[i], sequences[i - 1] + 2);
  EXPECT_GT(watched.pipeline->stats().dropped_frame_count, 5u);
}

TEST(Pipeline, PausesAndGoesOn) {
  Watched* self = nullptr;
  Watched::Options options;
  options.on_result = [&](const maquette::PipelineResult& result) {
    if (result.number == 3) self->pipeline->set_paused(true);
  };
  Watched watched(options);
  self = &watched;
  watched.pipeline->set_source("stub:pattern?frames=8&size=32x32");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_PAUSED));
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(watched.count(), 3u);
  watched.pipeline->set_paused(false);
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.sequences(), (std::vector<uint64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(Pipeline, ARollHoldsForTheNextFrames) {
  Watched* self = nullptr;
  std::vector<int> widths;
  Watched::Options options;
  options.on_result = [&](const maquette::PipelineResult& result) {
    widths.push_back(maquette::densepose_of(result).stats().network_width_px);
    if (result.number == 2) self->model->set_roll(1.57f);
  };
  Watched watched(options);
  self = &watched;
  watched.pipeline->set_source("stub:pattern?frames=4&size=64x32");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  ASSERT_EQ(widths.size(), 4u);
  EXPECT_EQ(widths[1], widths[0]);
  EXPECT_EQ(widths[2], widths[0] / 2) << "the input lies on its side";
  EXPECT_EQ(widths[3], widths[2]);
}

TEST(Pipeline, TheCameraIsLostAndComesBack) {
  Watched watched({});
  load_model(watched);
  watched.pipeline->set_source("stub:pattern?fps=50&size=64x48&unplug=1s@20");
  ASSERT_TRUE(watched.until([&] { return watched.saw(MAQ_PIPELINE_RECONNECTING); }));
  const maq_pipeline_info info = watched.pipeline->info();
  if (info.state == MAQ_PIPELINE_RECONNECTING) {
    EXPECT_EQ(info.status, MAQ_ERROR_DEVICE_LOST);
    EXPECT_STREQ(info.problem, "The camera was lost: unplugged, as its URI asks.");
  }
  ASSERT_TRUE(watched.until([&] { return watched.states().back() == MAQ_PIPELINE_RUNNING; }));
  const size_t before = watched.count();
  ASSERT_TRUE(watched.until([&] { return watched.count() > before + 5; }));
  EXPECT_EQ(watched.pipeline->info().status, MAQ_OK);
  EXPECT_STREQ(watched.pipeline->info().problem, "");
  EXPECT_EQ(watched.states(), (std::vector<maq_pipeline_state>{MAQ_PIPELINE_OPENING, MAQ_PIPELINE_RUNNING,
                                                               MAQ_PIPELINE_RECONNECTING, MAQ_PIPELINE_RUNNING}));
}

TEST(Pipeline, ACameraThatStallsIsReportedUntilItGoesOn) {
  Watched::Options options;
  options.stall_ms = 100;
  Watched watched(options);
  load_model(watched);
  watched.pipeline->set_source("stub:pattern?fps=50&size=64x48&stall=1s@10");
  ASSERT_TRUE(watched.until([&] { return watched.saw(MAQ_PIPELINE_STALLED); }));
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_RUNNING));
}

TEST(Pipeline, ACameraThatStaysAwayFailsAndAnotherSourceGoesOn) {
  Watched::Options options = polling(false);
  options.reconnect_ms = 200;
  Watched watched(options);
  watched.pipeline->set_source("stub:pattern?fps=50&size=64x48&unplug@5");
  maq_status status = MAQ_OK;
  while (status == MAQ_OK) status = status_of_next(*watched.pipeline);
  EXPECT_EQ(status, MAQ_ERROR_DEVICE_LOST);
  EXPECT_EQ(watched.pipeline->info().state, MAQ_PIPELINE_FAILED);
  EXPECT_EQ(watched.pipeline->info().status, MAQ_ERROR_DEVICE_LOST);
  EXPECT_STREQ(maq_last_error(watched.pipeline->get()), watched.pipeline->info().problem);
  watched.pipeline->set_source("stub:pattern?frames=2&size=32x32");
  EXPECT_EQ(watched.pipeline->next()->frame.desc().width_px, 32);
  EXPECT_STREQ(watched.pipeline->info().problem, "");
}

TEST(Pipeline, ABadSourceFailsWithItsSentence) {
  Watched watched(polling(false));
  for (const auto& [uri, status] :
       {std::pair("image:/none.jpg", MAQ_ERROR_NOT_FOUND), std::pair("stub:people?", MAQ_ERROR_INVALID_ARGUMENT),
        std::pair("tape:1", MAQ_ERROR_UNSUPPORTED)}) {
    watched.pipeline->set_source(uri);
    EXPECT_EQ(status_of_next(*watched.pipeline), status) << uri;
    EXPECT_EQ(watched.pipeline->info().state, MAQ_PIPELINE_FAILED);
    EXPECT_EQ(watched.pipeline->info().status, status);
    EXPECT_GT(std::string(watched.pipeline->info().problem).size(), 20u);
  }
  watched.pipeline->set_source("stub:pattern?frames=2&size=32x32");
  EXPECT_TRUE(watched.pipeline->next().has_value());
}

TEST(Pipeline, ACallbackCanChooseAnotherSource) {
  Watched* self = nullptr;
  Watched::Options options;
  options.on_state = [&](maq_pipeline_state state) {
    if (state == MAQ_PIPELINE_FAILED) self->pipeline->set_source("stub:pattern?frames=3&size=32x32");
  };
  Watched watched(options);
  self = &watched;
  watched.pipeline->set_source("image:/none.jpg");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.count(), 3u);
}

TEST(Pipeline, ABadModelFailsAndAGoodOneGoesOn) {
  Watched::Options options;
  options.bundle = "/no/bundle";
  Watched watched(options);
  EXPECT_EQ(watched.pipeline->info().state, MAQ_PIPELINE_STOPPED) << "no model is loaded for nothing";
  watched.pipeline->set_source("stub:pattern?frames=3&size=32x32");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_FAILED));
  EXPECT_EQ(watched.pipeline->info().status, MAQ_ERROR_NOT_FOUND);
  EXPECT_NE(std::string(watched.pipeline->info().problem).find("/no/bundle"), std::string::npos);
  watched.pipeline->set_source("stub:pattern?frames=2&size=32x32");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_FAILED)) << "another source does not hide it";
  const maq_densepose_config config = densepose_config();
  watched.set_model(config);
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.count(), 2u);
}

TEST(Pipeline, LoadingIsReportedBeforeItIsOver) {
  std::atomic<maq_status> surface_status{MAQ_OK};
  Watched::Options options;
  Watched* watched = nullptr;
  options.on_state = [&](maq_pipeline_state state) {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    if (state != MAQ_PIPELINE_LOADING) return;
    surface_status = maq_densepose_model_get_surface(watched->model->get(), &surface);
  };
  Watched with_callback(options);
  watched = &with_callback;
  with_callback.pipeline->set_source("stub:people?size=96x72&frames=1");
  ASSERT_TRUE(with_callback.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(surface_status, MAQ_ERROR_UNSUPPORTED) << "no model is loaded yet";
}

TEST(Pipeline, WithoutAConfigTheModelIsTheInstalledOne) {
  Watched watched(polling(false));
  watched.pipeline->set_source("stub:pattern?frames=1&size=64x48");
  const int before_px = maquette::densepose_of(*watched.pipeline->next()).stats().network_width_px;
  maq_model* model = nullptr;
  ASSERT_EQ(maq_densepose_model_create(watched.context.get(), nullptr, &model), MAQ_OK);
  ASSERT_EQ(maq_pipeline_set_model(watched.pipeline->get(), model), MAQ_OK);
  maq_model_destroy(model);
  watched.pipeline->set_source("stub:pattern?frames=1&size=64x48");
  const std::optional<maquette::PipelineResult> result = watched.pipeline->next();
  ASSERT_TRUE(result.has_value()) << watched.pipeline->info().problem;
  const int after_px = maquette::densepose_of(*result).stats().network_width_px;
  EXPECT_EQ(after_px, maquette::DensePose(watched.context).run(result->frame).stats().network_width_px);
  EXPECT_NE(after_px, before_px);
}

TEST(Pipeline, NoResultOfTheFormerSourceComesAfterAChange) {
  Watched watched(polling(true));
  for (int i = 0; i < 6; ++i) {
    const int width_px = 32 + 16 * (i % 2);
    watched.pipeline->set_source("stub:pattern?fps=100&size=" + std::to_string(width_px) + "x32");
    for (int k = 0; k < 3; ++k) EXPECT_EQ(watched.pipeline->next()->frame.desc().width_px, width_px);
  }
}

TEST(Pipeline, OptionsOfTheModelChangeWhileItRuns) {
  Watched watched(polling(true));
  watched.pipeline->set_source("stub:pattern?fps=50&size=64x48");
  const int before = maquette::densepose_of(*watched.pipeline->next()).stats().network_width_px;
  maq_densepose_config config = densepose_config();
  config.long_side_px = before / 2;
  watched.set_model(config);
  EXPECT_TRUE(watched.until([&] {
    return maquette::densepose_of(*watched.pipeline->next()).stats().network_width_px == config.long_side_px;
  }));
  EXPECT_EQ(watched.pipeline->info().state, MAQ_PIPELINE_RUNNING);
}

TEST(Pipeline, AFrameBudgetThatCannotBeKeptMakesTheModelDoLessAndTheStatsSaySo) {
  Watched::Options options;
  options.frame_budget_ms = 1e-3;
  Watched watched(std::move(options));
  EXPECT_EQ(watched.model->stats().long_side_px, 0) << "not loaded yet";
  watched.pipeline->set_source("stub:people?size=64x48&frames=40");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.pipeline->stats().result_count, 40u);
  const maq_densepose_model_stats stats = watched.model->stats();
  EXPECT_EQ(stats.key_frame_interval, 4);
  EXPECT_EQ(stats.long_side_px, 160) << "half of the tiny bundle's";
}

TEST(Pipeline, WithoutAFrameBudgetTheStatsSayWhatTheConfigDoes) {
  Watched watched({});
  watched.pipeline->set_source("stub:people?size=64x48&frames=20");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.model->stats().key_frame_interval, 1);
  EXPECT_EQ(watched.model->stats().long_side_px, 320);
}

TEST(Pipeline, ANegativeFrameBudgetIsRefused) {
  maquette::Context context;
  const maquette::DensePoseModel model(context);
  EXPECT_EQ(maq_densepose_model_set_frame_budget(model.get(), -1), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(maq_last_error(model.get())).find("budget_ms is -1"), std::string::npos);
}

TEST(Pipeline, APhotoIsMappedAgainWithOtherOptions) {
  Watched::Options options = polling(false);
  options.real_time = true;
  Watched watched(options);
  watched.pipeline->set_source("image:" MAQ_TEST_MEDIA "/photo.jpg?size=64x48");
  EXPECT_TRUE(watched.pipeline->next().has_value());
  EXPECT_FALSE(watched.pipeline->next().has_value());
  watched.set_model(densepose_config());
  EXPECT_TRUE(watched.pipeline->next().has_value());
  EXPECT_FALSE(watched.pipeline->next().has_value());
}

TEST(Pipeline, APhotoIsMappedAgainAlsoBeforeItsEndIsTold) {
  Watched watched(polling(false));
  for (int i = 0; i < 8; ++i) {
    watched.pipeline->set_source("image:" MAQ_TEST_MEDIA "/photo.jpg?size=64x48");
    ASSERT_TRUE(watched.pipeline->next().has_value()) << i;
    maq_densepose_config config = densepose_config();
    config.long_side_px = i % 2 == 0 ? 128 : 160;
    watched.set_model(config);
    const auto again = watched.pipeline->next();
    ASSERT_TRUE(again.has_value()) << i;
    EXPECT_EQ(maquette::densepose_of(*again).stats().network_width_px, config.long_side_px) << i;
  }
}

TEST(Pipeline, StoppingCancelsACallThatWaits) {
  Watched watched(polling(true));
  EXPECT_EQ(status_of_next(*watched.pipeline), MAQ_CANCELLED) << "it has no source yet";
  watched.pipeline->set_source("stub:pattern?fps=0.01&size=32x32");
  status_of_next(*watched.pipeline);  // the first frame comes at once
  EXPECT_EQ(status_of_next(*watched.pipeline, 1000000), MAQ_TIMEOUT);
  EXPECT_STREQ(maq_last_error(watched.pipeline->get()), "No result came within 1 ms.");
  maq_status status = MAQ_OK;
  std::thread waits([&] { status = status_of_next(*watched.pipeline); });
  std::this_thread::sleep_for(20ms);
  watched.pipeline->stop();
  waits.join();
  EXPECT_EQ(status, MAQ_CANCELLED);
  EXPECT_EQ(watched.pipeline->info().state, MAQ_PIPELINE_STOPPED);
  EXPECT_STREQ(watched.pipeline->info().source_uri, "");
}

TEST(Pipeline, AfterAStopNoCallbackRunsUntilItStartsAgain) {
  std::atomic<int> inside{0}, calls{0};
  Watched::Options options;
  options.real_time = true;
  options.on_result = [&](const maquette::PipelineResult&) {
    ++inside, ++calls;
    std::this_thread::sleep_for(3ms);
    --inside;
  };
  Watched watched(options);
  for (int i = 0; i < 10; ++i) {
    const int before = calls;
    watched.pipeline->set_source("stub:pattern?fps=200&size=32x32");
    ASSERT_TRUE(watched.until([&] { return calls > before + i % 3; }));
    watched.pipeline->stop();
    EXPECT_EQ(inside, 0);
    const int after = calls;
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(calls, after);
  }
}

TEST(Pipeline, StopsFromACallback) {
  Watched* self = nullptr;
  Watched::Options options;
  options.on_result = [&](const maquette::PipelineResult&) {
    if (self->count() % 2 == 0) self->pipeline->stop();
  };
  Watched watched(options);
  self = &watched;
  for (size_t round = 1; round <= 3; ++round) {
    watched.pipeline->set_source("stub:pattern?size=32x32");
    ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_STOPPED));
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(watched.count(), 2 * round);
  }
}

TEST(Pipeline, CanBeDestroyedAtAnyTime) {
  for (int i = 0; i < 8; ++i) {
    Watched::Options options = polling(i % 2 == 0);
    options.polls = i % 3 == 0;
    Watched watched(options);
    watched.pipeline->set_source("stub:people?size=64x48");
    const uint64_t enough = i < 4 ? 0 : uint64_t(i - 3);
    ASSERT_TRUE(watched.until([&] { return watched.pipeline->stats().result_count >= enough; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(i % 4 * 5));
  }
}

TEST(Pipeline, CanBeDestroyedByItsOwnCallback) {
  Watched* self = nullptr;
  std::atomic<bool> gone{false};
  Watched::Options options;
  options.on_result = [&](const maquette::PipelineResult& result) {
    if (result.number != 3) return;
    self->pipeline.reset();
    gone = true;
  };
  Watched watched(options);
  self = &watched;
  watched.pipeline->set_source("stub:pattern?size=32x32");
  ASSERT_TRUE(watched.until([&] { return gone.load(); }));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(watched.count(), 3u);
}

TEST(Pipeline, ACameraThatHangsDoesNotHoldUpTheApp) {
  const auto begin = std::chrono::steady_clock::now();
  {
    Watched watched({});
    watched.pipeline->set_source("stub:pattern?fps=50&size=64x48&hang=120s@10");
    ASSERT_TRUE(watched.until([&] { return watched.count() >= 1; }));
    std::this_thread::sleep_for(400ms);
    watched.pipeline->set_source("stub:pattern?fps=50&size=32x32");
    ASSERT_TRUE(watched.until([&] { return watched.widths().back() == 32; }));
    watched.pipeline->set_source("stub:pattern?fps=50&size=64x48&hang=120s@1");
    std::this_thread::sleep_for(400ms);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 100s);
}

TEST(Pipeline, ResultsThatAreHeldOutliveIt) {
  std::vector<maquette::PipelineResult> held;
  {
    Watched watched(polling(true));
    watched.pipeline->set_source("stub:people?fps=50&size=64x48");
    for (int i = 0; i < 4; ++i) held.push_back(*watched.pipeline->next());
    EXPECT_EQ(status_of_next(*watched.pipeline), MAQ_ERROR_POOL_EMPTY);
    held.pop_back();
    EXPECT_EQ(status_of_next(*watched.pipeline), MAQ_OK);
  }
  std::vector<uint8_t> pixels(64 * 48 * 3);
  for (const maquette::PipelineResult& result : held) {
    result.frame.copy_pixels(MAQ_PIXEL_BGR8, pixels.data(), 0, pixels.size());
    EXPECT_EQ(maquette::densepose_of(result).height_px(), 48);
  }
}

TEST(Pipeline, ResultsAreDroppedWhileACallbackHoldsThemAll) {
  std::vector<maquette::PipelineResult> held;
  Watched::Options options;
  options.pool_size = 2;
  maquette::Context context;
  maq_pipeline_config config = maquette::default_pipeline_config();
  config.result_pool_size = 2;
  config.result_user_data = &held;
  config.result_callback = [](void* all, maq_pipeline_result* result) {
    static_cast<std::vector<maquette::PipelineResult>*>(all)->emplace_back(result);
  };
  maquette::Pipeline pipeline(context, config);
  pipeline.set_model(maquette::DensePoseModel(context, densepose_config()));
  pipeline.set_source("stub:pattern?frames=6&size=32x32");
  const auto end = std::chrono::steady_clock::now() + kLongEnough;
  while (pipeline.info().state != MAQ_PIPELINE_ENDED && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(5ms);
  }
  pipeline.stop();
  EXPECT_EQ(held.size(), 2u);
  EXPECT_EQ(pipeline.stats().result_count, 6u);
  EXPECT_EQ(pipeline.stats().dropped_result_count, 4u);
  EXPECT_EQ(status_of_next(pipeline), MAQ_ERROR_UNSUPPORTED) << "it has a callback";
}

TEST(Pipeline, ACallbackThatThrowsIsAnErrorOfTheApp) {
  maquette::Context context;
  maq_pipeline_config config = maquette::default_pipeline_config();
  config.result_callback = [](void*, maq_pipeline_result* result) {
    maq_pipeline_result_release(result);
    throw std::runtime_error("Own error.");
  };
  maquette::Pipeline pipeline(context, config);
  pipeline.set_model(maquette::DensePoseModel(context, densepose_config()));
  pipeline.set_source("stub:pattern?frames=6&size=32x32");
  const auto end = std::chrono::steady_clock::now() + kLongEnough;
  while (pipeline.info().state != MAQ_PIPELINE_FAILED && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(5ms);
  }
  const maq_pipeline_info info = pipeline.info();
  EXPECT_EQ(info.status, MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(info.problem).find("config.result_callback threw an exception (Own error.)"), std::string::npos)
      << info.problem;
}

TEST(Pipeline, RecordsWhatItMaps) {
  const TempFolder folder;
  Watched watched({});
  watched.pipeline->set_recording(folder.file("a.maqrec"));
  watched.pipeline->set_source("stub:pattern?frames=6&size=64x48&fps=20");
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  maquette::Source player(watched.context, "rec:" + folder.file("a.maqrec"));
  EXPECT_EQ(player.info().frame_count, 6);
  EXPECT_NEAR(player.info().fps, 20, 1e-6);

  watched.pipeline->set_recording("/no/folder/b.maqrec");
  watched.pipeline->set_source("stub:pattern?frames=6&size=64x48");
  ASSERT_TRUE(watched.until([&] { return watched.count() == 12; })) << "frames go on without the recording";
  ASSERT_TRUE(watched.until_state(MAQ_PIPELINE_ENDED));
  EXPECT_EQ(watched.pipeline->info().status, MAQ_ERROR_UNWRITABLE);
  EXPECT_NE(std::string(watched.pipeline->info().problem).find("/no/folder"), std::string::npos);
}

TEST(Pipeline, ARecordingIsCompleteWhenItIsDestroyed) {
  const TempFolder folder;
  {
    Watched::Options options;
    options.real_time = true;
    Watched watched(options);
    watched.pipeline->set_recording(folder.file("a.maqrec"));
    watched.pipeline->set_source("stub:pattern?fps=50&size=64x48");
    ASSERT_TRUE(watched.until([&] { return watched.count() > 5; }));
  }
  std::string warned;
  maq_context_config config = maquette::default_context_config();
  config.log_callback = [](void* text, maq_log_level, const char* line) { *static_cast<std::string*>(text) += line; };
  config.log_user_data = &warned;
  const maquette::Context context(config);
  EXPECT_GT(maquette::Source(context, "rec:" + folder.file("a.maqrec")).info().frame_count, 5);
  EXPECT_EQ(warned, "") << "it has its index";
}

TEST(Pipeline, AModelKnowsItsSurface) {
  Watched::Options options = polling(false);
  options.bundle = MAQ_TEST_MODELS "/densepose-b-int8";
  Watched watched(options);
  EXPECT_FALSE(watched.model->surface().has_value()) << "no model is loaded yet";
  watched.pipeline->set_source("stub:pattern?frames=1&size=64x48");
  ASSERT_TRUE(watched.pipeline->next().has_value());
  const std::optional<maq_densepose_surface> surface = watched.model->surface();
  ASSERT_TRUE(surface.has_value());
  EXPECT_GE(surface->nodes, 2);
  watched.pipeline->remove_model();
  watched.pipeline->set_source("stub:pattern?frames=1&size=64x48");
  ASSERT_TRUE(watched.pipeline->next().has_value());
  EXPECT_EQ(watched.model->surface()->points_m, surface->points_m) << "it stays where it is as long as the model";
}

TEST(Pipeline, RefusesWrongArguments) {
  const maquette::Context context;
  maq_pipeline* pipeline = nullptr;
  const auto refused = [&](const maq_pipeline_config& config) {
    EXPECT_EQ(maq_pipeline_create(context.get(), &config, &pipeline), MAQ_ERROR_INVALID_ARGUMENT);
    return std::string(maq_last_error(context.get()));
  };
  maq_pipeline_config config = maquette::default_pipeline_config();
  maq_source_config source = maquette::default_source_config();
  source.state_callback = [](void*, maq_source_state, const char*) {};
  config.source = &source;
  EXPECT_NE(refused(config).find("config.source.state_callback"), std::string::npos);
  source = maquette::default_source_config();
  source.max_side_px = -1;
  EXPECT_NE(refused(config).find("max_side_px is -1"), std::string::npos);
  EXPECT_EQ(pipeline, nullptr);

  maquette::Pipeline good(context);
  const maquette::DensePoseModel model(context, densepose_config());
  EXPECT_EQ(maq_pipeline_set_paused(good.get(), 2), MAQ_ERROR_INVALID_ARGUMENT);
  for (const float roll : {7.1f, -8.0f, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(maq_densepose_model_set_roll(model.get(), roll), MAQ_ERROR_INVALID_ARGUMENT) << roll;
  }
  EXPECT_EQ(maq_pipeline_set_recording(good.get(), ""), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_pipeline_result_get_frame(nullptr), nullptr);
  EXPECT_EQ(maq_pipeline_result_get_densepose(nullptr), nullptr);
}

TEST(Pipeline, WithoutAModelResultsHaveAFrameOnly) {
  const maquette::Context context;
  maquette::Pipeline pipeline(context);
  pipeline.set_source("stub:pattern?frames=1&size=64x48");
  const std::optional<maquette::PipelineResult> result = pipeline.next();
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->frame.desc().width_px, 64);
  EXPECT_EQ(maquette::densepose_of(*result).get(), nullptr);
  EXPECT_FALSE(pipeline.next().has_value());
}

TEST(Pipeline, OnePipelineAtATimeRunsAModel) {
  const maquette::Context context;
  const maquette::DensePoseModel model(context, densepose_config());
  maquette::Pipeline second(context);
  {
    maquette::Pipeline first(context);
    first.set_model(model);
    first.set_model(model);
    EXPECT_EQ(maq_pipeline_set_model(second.get(), model.get()), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(maq_last_error(second.get())).find("in use by another pipeline"), std::string::npos);
  }
  second.set_model(model);
  second.set_source("stub:pattern?frames=1&size=64x48");
  EXPECT_EQ(maquette::densepose_of(*second.next()).width_px(), 64);
}

TEST(Pipeline, PartsOfAResultAreGivenBackWithIt) {
  Watched watched(polling(false));
  watched.pipeline->set_source("stub:pattern?frames=1&size=64x48");
  maq_pipeline_result* result = nullptr;
  ASSERT_EQ(maq_pipeline_acquire_result(watched.pipeline->get(), MAQ_WAIT_FOREVER, &result), MAQ_OK);
  const maq_frame* const frame = maq_pipeline_result_get_frame(result);
  const maq_densepose_result* const people = maq_pipeline_result_get_densepose(result);
  maq_frame_release(const_cast<maq_frame*>(frame));
  EXPECT_NE(std::string(maq_last_error(nullptr)).find("belongs to a result of a pipeline"), std::string::npos);
  maq_frame_desc desc{};
  desc.struct_size = sizeof desc;
  EXPECT_EQ(maq_frame_get_desc(frame, &desc), MAQ_OK);
  int32_t width_px = 0;
  EXPECT_EQ(maq_densepose_result_get_size(people, &width_px, nullptr), MAQ_OK);
  EXPECT_EQ(width_px, 64);
  maq_pipeline_result_release(result);
  EXPECT_EQ(maq_frame_get_desc(frame, &desc), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST(Pipeline, BearsCallsFromManyThreads) {
  Watched watched(polling(true));
  std::atomic<bool> done{false};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; !done; ++i) {
        switch ((i + t) % 5) {
          case 0: watched.pipeline->set_source("stub:pattern?fps=100&size=" + std::to_string(32 + t) + "x32"); break;
          case 1: watched.pipeline->set_paused(i % 2 == 0); break;
          case 2: watched.pipeline->info(); break;
          case 3: status_of_next(*watched.pipeline, 20000000); break;
          default:
            t == 0 ? watched.pipeline->stop()
                   : watched.pipeline->set_model(maquette::DensePoseModel(watched.context, densepose_config()));
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(t));
      }
    });
  }
  std::this_thread::sleep_for(1s);
  done = true;
  for (std::thread& thread : threads) thread.join();
  watched.pipeline->set_paused(false);
  watched.pipeline->set_source("stub:pattern?frames=1&size=80x32");
  EXPECT_EQ(watched.pipeline->next()->frame.desc().width_px, 80);
}

}  // namespace
