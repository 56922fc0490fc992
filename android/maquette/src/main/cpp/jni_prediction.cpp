// What a stream will show next, how surprising what it shows is, and live sources whose short gaps are bridged.
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

// How long a wait for a frame of a concealer may hold up its closing.
constexpr int64_t kSlice_ns = 50000000;

// What Java has as a concealer. The C API's has no call that ends a wait but the one that stops its source.
struct StoppableConcealer {
  maq_concealer* concealer = nullptr;
  jobject source = nullptr;  // global: the garbage collector would stop a source that the app has forgotten
  std::atomic<bool> is_stopped{false};
};

maq_predictor_config predictor_config(const std::vector<jdouble>& from) {
  maq_predictor_config config;
  check(maq_predictor_config_init(&config, sizeof config));
  config.threads = int32_t(from[0]);
  config.frame_pool_size = maq_jni::count_of(from[2]);
  return config;
}

}  // namespace

// `values` as in Predictor.Config.
MAQ_NATIVE_OF(NativePrediction, jlong, createPredictor)
(JNIEnv* env, jclass, jlong context, jdoubleArray values) {
  return call(env, [&] {
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 3);
    maq_predictor_config config = predictor_config(from);
    config.method = maq_prediction_method(int32_t(from[1]));
    maq_predictor* predictor = nullptr;
    check(maq_predictor_create(object<maq_context>(context), &config, &predictor));
    return handle(predictor);
  });
}

// `values` as in Predictor.Config; where it draws, then as in Predictor.Sampling without its seed.
MAQ_NATIVE_OF(NativePrediction, jlong, createNetworkPredictor)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values,
 jlong seed) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const bool draws = env->GetArrayLength(values) > 3;
    const std::vector<jdouble> from = maq_jni::numbers(env, values, draws ? 6 : 3);
    maq_predictor_config config = predictor_config(from);
    bundle.put_into(config);
    config.method = MAQ_PREDICTION_NETWORK;
    config.network_mode = draws ? MAQ_NETWORK_DRAWN : MAQ_NETWORK_MENDED;
    if (draws) {
      config.temperature = float(from[3]);
      config.top_k = maq_jni::count_of(from[4]);
      config.passes = maq_jni::count_of(from[5]);
      config.seed = uint64_t(seed);
    }
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

MAQ_NATIVE_OF(NativePrediction, void, draw)
(JNIEnv* env, jclass, jlong predictor, jint samples, jint frames, jdouble step_s) {
  call(env, [&] {
    check(maq_predictor_draw(object<maq_predictor>(predictor), uint32_t(samples), uint32_t(frames), step_s));
  });
}

MAQ_NATIVE_OF(NativePrediction, jlong, drawn)(JNIEnv* env, jclass, jlong predictor, jint sample, jint number) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    check(maq_predictor_acquire_drawn(object<maq_predictor>(predictor), uint32_t(sample), uint32_t(number), &frame));
    return handle(frame);
  });
}

MAQ_NATIVE_OF(NativePrediction, jfloatArray, uncertainty)
(JNIEnv* env, jclass, jlong predictor, jint sample, jint number) {
  return call(env, [&] {
    const auto* const drawing = object<maq_predictor>(predictor);
    auto stats = sized<maq_predictor_stats>();
    check(maq_predictor_get_stats(drawing, &stats));
    std::vector<jfloat> bits(stats.cell_count > 0 ? stats.cell_count : 1);
    check(maq_predictor_copy_uncertainty(drawing, uint32_t(sample), uint32_t(number), bits.data(), bits.size()));
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
        env, {s.grey_ms, s.flow_ms, s.choice_ms, s.push_ms, s.project_ms, s.fetch_ms, s.predict_ms, double(s.method),
              s.motion_fraction, double(s.pushed_count), double(s.predicted_count), double(s.reset_count),
              s.networks_ms, double(s.drawn_count), double(s.step_count), double(s.pass_count)});
  });
}

// `values` as in Surprise.Config. `networks_of` may be 0; else no bundle is read.
MAQ_NATIVE_OF(NativePrediction, jlong, createSurprise)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values,
 jlong networks_of) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 4);
    maq_surprise_config config;
    check(maq_surprise_config_init(&config, sizeof config));
    bundle.put_into(config);
    config.threads = int32_t(from[0]);
    config.allow_spinning = int32_t(from[1]);
    config.event_ratio = float(from[2]);
    config.method = from[3] != 0 ? MAQ_SURPRISE_TABLE : MAQ_SURPRISE_AUTO;
    config.networks_of = object<maq_surprise>(networks_of);
    maq_surprise* surprise = nullptr;
    check(maq_surprise_create(object<maq_context>(context), &config, &surprise));
    return handle(surprise);
  });
}

MAQ_NATIVE_OF(NativePrediction, void, destroySurprise)(JNIEnv*, jclass, jlong surprise) {
  maq_surprise_destroy(object<maq_surprise>(surprise));
}

// Columns, rows, bits and ratio, whether it is an event, a cut and a start; then the map.
MAQ_NATIVE_OF(NativePrediction, jfloatArray, pushToSurprise)(JNIEnv* env, jclass, jlong surprise, jlong frame) {
  return call(env, [&] {
    auto* const stream = object<maq_surprise>(surprise);
    auto score = sized<maq_surprise_score>();
    check(maq_surprise_push(stream, object<maq_frame>(frame), &score));
    std::vector<jfloat> values = {float(score.columns),  float(score.rows),   score.bits,           score.ratio,
                                  float(score.is_event), float(score.is_cut), float(score.is_start)};
    const size_t scalars = values.size(), cells = size_t(score.columns) * size_t(score.rows);
    values.resize(scalars + cells);
    check(maq_surprise_copy_map(stream, &values[scalars], cells));
    return maq_jni::floats_of(env, values.data(), values.size());
  });
}

MAQ_NATIVE_OF(NativePrediction, jlong, rebuilt)(JNIEnv* env, jclass, jlong surprise) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    check(maq_surprise_acquire_rebuilt(object<maq_surprise>(surprise), &frame));
    return handle(frame);
  });
}

MAQ_NATIVE_OF(NativePrediction, void, resetSurprise)(JNIEnv* env, jclass, jlong surprise) {
  call(env, [&] { check(maq_surprise_reset(object<maq_surprise>(surprise))); });
}

// In the order of maq_surprise_stats.
MAQ_NATIVE_OF(NativePrediction, jdoubleArray, statsOfSurprise)(JNIEnv* env, jclass, jlong surprise) {
  return call(env, [&] {
    auto s = sized<maq_surprise_stats>();
    check(maq_surprise_get_stats(object<maq_surprise>(surprise), &s));
    return maq_jni::doubles_of(
        env, {s.resize_ms, s.network_ms, s.nearest_ms, s.push_ms, double(s.threads), double(s.pushed_count),
              double(s.event_count), double(s.start_count), s.transformer_ms});
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
    config.method = maq_prediction_method(int32_t(from[2]));
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

// 0 after the source's last frame, and after a stop of the source or of this.
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
