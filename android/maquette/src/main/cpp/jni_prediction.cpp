// Prediction, novelty, and live sources with short gaps filled.
#include <atomic>
#include <chrono>
#include <memory>

#include "jni_config.h"
#include "jni_threads.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;
using maq_jni::sized;

namespace {

// The longest time that a wait for a frame delays closing.
constexpr int64_t kSlice_ns = 50000000;

// The concealer of Java. In the C API, only stopping the source ends a wait.
struct StoppableConcealer {
  maq_concealer* concealer = nullptr;
  jobject source = nullptr;  // global: the garbage collector would stop a source that the app has forgotten
  std::atomic<bool> is_stopped{false};
};

}  // namespace

// `values` as in Predictor.Config.
MAQ_NATIVE_OF(NativePrediction, jlong, createPredictor)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values,
 jlong seed) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 5);
    maq_predictor_config config;
    check(maq_predictor_config_init(&config, sizeof config));
    bundle.put_into(config.model);
    config.model.threads = int32_t(from[0]);
    config.method = maq_predictor_method(int32_t(from[1]));
    config.frame_pool_size = maq_jni::count_of(from[2]);
    config.temperature = float(from[3]);
    config.top_k = maq_jni::count_of(from[4]);
    config.seed = uint64_t(seed);
    maq_predictor* predictor = nullptr;
    check(maq_predictor_create(object<maq_context>(context), &config, &predictor));
    return handle(predictor);
  });
}

MAQ_NATIVE_OF(NativePrediction, void, destroyPredictor)(JNIEnv*, jclass, jlong predictor) {
  maq_predictor_destroy(object<maq_predictor>(predictor));
}

MAQ_NATIVE_OF(NativePrediction, void, pushToPredictor)(JNIEnv* env, jclass, jlong predictor, jlong frame) {
  call(env, [&] { check(maq_predictor_push(object<maq_predictor>(predictor), object<maq_frame>(frame))); });
}

MAQ_NATIVE_OF(NativePrediction, jlong, predict)(JNIEnv* env, jclass, jlong predictor, jdouble ahead_s) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    check(maq_predictor_predict(object<maq_predictor>(predictor), ahead_s, &frame));
    return handle(frame);
  });
}

MAQ_NATIVE_OF(NativePrediction, void, sample)
(JNIEnv* env, jclass, jlong predictor, jint sample_count, jint frame_count, jdouble step_s) {
  call(env, [&] {
    check(
        maq_predictor_sample(object<maq_predictor>(predictor), uint32_t(sample_count), uint32_t(frame_count), step_s));
  });
}

MAQ_NATIVE_OF(NativePrediction, void, cancelPredictor)(JNIEnv* env, jclass, jlong predictor) {
  call(env, [&] { check(maq_predictor_cancel(object<maq_predictor>(predictor))); });
}

MAQ_NATIVE_OF(NativePrediction, jlong, acquireSample)
(JNIEnv* env, jclass, jlong predictor, jint sample_index, jint frame_index) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    check(maq_predictor_acquire_sample(object<maq_predictor>(predictor), uint32_t(sample_index), uint32_t(frame_index),
                                       &frame));
    return handle(frame);
  });
}

MAQ_NATIVE_OF(NativePrediction, jfloatArray, entropyMap)
(JNIEnv* env, jclass, jlong predictor, jint sample_index, jint frame_index) {
  return call(env, [&] {
    const auto* const sampling = object<maq_predictor>(predictor);
    auto stats = sized<maq_predictor_stats>();
    check(maq_predictor_get_stats(sampling, &stats));
    std::vector<jfloat> bits(stats.cell_count > 0 ? stats.cell_count : 1);
    check(maq_predictor_copy_entropy_map(sampling, uint32_t(sample_index), uint32_t(frame_index), bits.data(),
                                         bits.size()));
    return maq_jni::floats_of(env, bits.data(), bits.size());
  });
}

MAQ_NATIVE_OF(NativePrediction, void, resetPredictor)(JNIEnv* env, jclass, jlong predictor) {
  call(env, [&] { check(maq_predictor_reset(object<maq_predictor>(predictor))); });
}

// In the order of Predictor.Stats.
MAQ_NATIVE_OF(NativePrediction, jdoubleArray, statsOfPredictor)(JNIEnv* env, jclass, jlong predictor) {
  return call(env, [&] {
    auto s = sized<maq_predictor_stats>();
    check(maq_predictor_get_stats(object<maq_predictor>(predictor), &s));
    return maq_jni::doubles_of(
        env, {s.luma_ms, s.flow_ms, s.weights_ms, s.push_ms, s.project_ms, s.warp_ms, s.predict_ms, s.networks_ms,
              double(s.method), s.motion_fraction, double(s.pushed_count), double(s.predicted_count),
              double(s.reset_count), double(s.sampled_frame_count), double(s.step_count)});
  });
}

// `values` as in Novelty.Config. `shared_with` may be 0; otherwise no bundle is read.
MAQ_NATIVE_OF(NativePrediction, jlong, createNovelty)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values,
 jlong shared_with) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 4);
    maq_novelty_config config;
    check(maq_novelty_config_init(&config, sizeof config));
    bundle.put_into(config.model);
    config.model.threads = int32_t(from[0]);
    config.model.spinning = from[1] != 0 ? MAQ_SPINNING_ON : MAQ_SPINNING_OFF;
    config.event_ratio = float(from[2]);
    config.method = maq_novelty_method(int32_t(from[3]));
    config.shared_with = object<maq_novelty>(shared_with);
    maq_novelty* novelty = nullptr;
    check(maq_novelty_create(object<maq_context>(context), &config, &novelty));
    return handle(novelty);
  });
}

MAQ_NATIVE_OF(NativePrediction, void, destroyNovelty)(JNIEnv*, jclass, jlong novelty) {
  maq_novelty_destroy(object<maq_novelty>(novelty));
}

// Returns columns, rows, bits, ratio, is event, is cut, is stream start; then the map.
MAQ_NATIVE_OF(NativePrediction, jfloatArray, pushToNovelty)(JNIEnv* env, jclass, jlong novelty, jlong frame) {
  return call(env, [&] {
    auto* const stream = object<maq_novelty>(novelty);
    auto score = sized<maq_novelty_score>();
    check(maq_novelty_push(stream, object<maq_frame>(frame), &score));
    std::vector<jfloat> values = {
        float(score.columns), float(score.rows),           score.bits, score.ratio, float(score.is_event),
        float(score.is_cut),  float(score.is_stream_start)};
    const size_t scalars = values.size(), cells = size_t(score.columns) * size_t(score.rows);
    values.resize(scalars + cells);
    check(maq_novelty_copy_map(stream, &values[scalars], cells));
    return maq_jni::floats_of(env, values.data(), values.size());
  });
}

MAQ_NATIVE_OF(NativePrediction, jlong, reconstruction)(JNIEnv* env, jclass, jlong novelty) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    check(maq_novelty_acquire_reconstruction(object<maq_novelty>(novelty), &frame));
    return handle(frame);
  });
}

MAQ_NATIVE_OF(NativePrediction, void, resetNovelty)(JNIEnv* env, jclass, jlong novelty) {
  call(env, [&] { check(maq_novelty_reset(object<maq_novelty>(novelty))); });
}

// In the order of maq_novelty_stats.
MAQ_NATIVE_OF(NativePrediction, jdoubleArray, statsOfNovelty)(JNIEnv* env, jclass, jlong novelty) {
  return call(env, [&] {
    auto s = sized<maq_novelty_stats>();
    check(maq_novelty_get_stats(object<maq_novelty>(novelty), &s));
    return maq_jni::doubles_of(env,
                               {s.resize_ms, s.network_ms, s.nearest_ms, s.transformer_ms, s.push_ms, double(s.threads),
                                double(s.pushed_count), double(s.event_count), double(s.stream_start_count)});
  });
}

// `values` as in Concealer.Config. `source` is the handle of `kept`, which is kept until the concealer is destroyed.
MAQ_NATIVE_OF(NativePrediction, jlong, createConcealer)
(JNIEnv* env, jclass, jlong context, jlong source, jobject kept, jdoubleArray values) {
  return call(env, [&] {
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 4);
    maq_concealer_config config;
    check(maq_concealer_config_init(&config, sizeof config));
    config.max_gap_ms = int32_t(from[0]);
    config.threads = int32_t(from[1]);
    config.method = maq_predictor_method(int32_t(from[2]));
    config.frame_pool_size = maq_jni::count_of(from[3]);
    auto made = std::make_unique<StoppableConcealer>();
    check(maq_concealer_create(object<maq_context>(context), maq_jni::Listened<maq_source>::of(source), &config,
                               &made->concealer));
    made->source = env->NewGlobalRef(kept);
    return handle(made.release());
  });
}

MAQ_NATIVE_OF(NativePrediction, void, destroyConcealer)(JNIEnv* env, jclass, jlong concealer) {
  const std::unique_ptr<StoppableConcealer> taken(object<StoppableConcealer>(concealer));
  maq_concealer_destroy(taken->concealer);
  env->DeleteGlobalRef(taken->source);
}

// Ends a wait for a frame, and those to come. Does not block.
MAQ_NATIVE_OF(NativePrediction, void, stopConcealer)(JNIEnv*, jclass, jlong concealer) {
  object<StoppableConcealer>(concealer)->is_stopped = true;
}

// Returns 0 after the source's last frame, and after a stop of the source or of this.
MAQ_NATIVE_OF(NativePrediction, jlong, acquireFromConcealer)(JNIEnv* env, jclass, jlong concealer, jlong timeout_ns) {
  return call(env, [&]() -> jlong {
    using Clock = std::chrono::steady_clock;
    auto* const from = object<StoppableConcealer>(concealer);
    const auto begin = Clock::now();
    while (!from->is_stopped) {
      const int64_t left_ns =
          timeout_ns < 0 ? kSlice_ns
                         : std::max<int64_t>(0, timeout_ns - std::chrono::nanoseconds(Clock::now() - begin).count());
      maq_frame* frame = nullptr;
      const maq_status status = maq_concealer_acquire_frame(from->concealer, std::min(left_ns, kSlice_ns), &frame);
      if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) return 0;
      if (status == MAQ_TIMEOUT && (timeout_ns < 0 || left_ns > kSlice_ns)) continue;
      if (status == MAQ_TIMEOUT) {
        throw maq_jni::StatusError{MAQ_TIMEOUT,
                                   "No frame came within " + std::to_string(timeout_ns / 1000000) + " ms."};
      }
      check(status);
      return handle(frame);
    }
    return 0;
  });
}

// In the order of maq_concealer_stats.
MAQ_NATIVE_OF(NativePrediction, jdoubleArray, statsOfConcealer)(JNIEnv* env, jclass, jlong concealer) {
  return call(env, [&] {
    auto s = sized<maq_concealer_stats>();
    check(maq_concealer_get_stats(object<StoppableConcealer>(concealer)->concealer, &s));
    return maq_jni::doubles_of(env, {double(s.captured_count), double(s.predicted_count), double(s.late_count),
                                     double(s.dropped_count), s.latest_gap_ms, s.latest_wait_ms, s.max_wait_ms});
  });
}
