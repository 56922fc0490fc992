// Maquette for C++17: classes and exceptions over the C API, in this header alone. The C headers document each call.
//
//   maquette::Context context;
//   maquette::Source source(context, "video:clip.mp4");
//   maquette::DensePose densepose(context);
//   while (auto frame = source.next()) {
//     auto result = densepose.run(*frame);
//     for (const maq_person& person : result.people()) …
//   }
//
// Every class owns one handle, can be moved but not copied, and returns the handle by get(). Calls that fail throw
// maquette::Error.
#ifndef MAQUETTE_MAQUETTE_HPP_
#define MAQUETTE_MAQUETTE_HPP_

#include <array>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "maquette/maquette.h"

namespace maquette {

class Error : public std::runtime_error {
 public:
  Error(maq_status status, const char* text) : std::runtime_error(text), status_(status) {}
  maq_status status() const noexcept { return status_; }

 private:
  maq_status status_;
};

// Throws the error of this thread's latest call when `status` is one.
inline void check(maq_status status) {
  if (status != MAQ_OK) throw Error(status, maq_last_error(nullptr));
}

template <class Handle, void (*destroy)(Handle*)>
struct HandleDeleter {
  void operator()(Handle* handle) const noexcept { destroy(handle); }
};
template <class Handle, void (*destroy)(Handle*)>
using Owner = std::unique_ptr<Handle, HandleDeleter<Handle, destroy>>;

inline maq_context_config default_context_config() {
  maq_context_config config;
  check(maq_context_config_init(&config, sizeof config));
  return config;
}

inline maq_densepose_config default_densepose_config() {
  maq_densepose_config config;
  check(maq_densepose_config_init(&config, sizeof config));
  return config;
}

inline maq_edges_config default_edges_config() {
  maq_edges_config config;
  check(maq_edges_config_init(&config, sizeof config));
  return config;
}

inline maq_edges_curves_config default_edges_curves_config() {
  maq_edges_curves_config config;
  check(maq_edges_curves_config_init(&config, sizeof config));
  return config;
}

inline maq_edges_fusion_config default_edges_fusion_config() {
  maq_edges_fusion_config config;
  check(maq_edges_fusion_config_init(&config, sizeof config));
  return config;
}

inline maq_source_config default_source_config() {
  maq_source_config config;
  check(maq_source_config_init(&config, sizeof config));
  return config;
}

class Context {
 public:
  Context() : Context(default_context_config()) {}
  explicit Context(const maq_context_config& config) {
    maq_context* made = nullptr;
    check(maq_context_create(MAQ_HEADER_VERSION, &config, &made));
    owner_.reset(made);
  }

  maq_context* get() const { return owner_.get(); }

  std::string onnxruntime_version() const {
    const char* version = "";
    check(maq_context_get_onnxruntime(get(), &version, nullptr));
    return version;
  }
  std::string onnxruntime_path() const {
    const char* path = "";
    check(maq_context_get_onnxruntime(get(), nullptr, &path));
    return path;
  }

 private:
  Owner<maq_context, maq_context_destroy> owner_;
};

class Frame {
 public:
  // Takes over a frame of the C API.
  explicit Frame(maq_frame* frame) : owner_(frame) {}

  // Pixels of the app, which must stay until the frame is gone.
  Frame(const Context& context, const maq_frame_desc& desc) {
    maq_frame* made = nullptr;
    check(maq_frame_wrap(context.get(), &desc, nullptr, nullptr, &made));
    owner_.reset(made);
  }

  // An image file in memory, of `size_bytes` at `data`, which is not needed afterwards.
  static Frame decode(const Context& context, const void* data, size_t size_bytes) {
    maq_frame* made = nullptr;
    check(maq_frame_decode(context.get(), data, size_bytes, &made));
    return Frame(made);
  }

  // A copy of an image in planes of Y, U and V, which are not needed afterwards.
  static Frame convert_yuv(const Context& context, const maq_yuv_image& image) {
    maq_frame* made = nullptr;
    check(maq_frame_convert_yuv(context.get(), &image, &made));
    return Frame(made);
  }

  maq_frame* get() const { return owner_.get(); }

  maq_frame_desc desc() const {
    maq_frame_desc desc{};
    desc.struct_size = sizeof desc;
    check(maq_frame_get_desc(get(), &desc));
    return desc;
  }

  // Nothing when the frame came without depth.
  std::optional<maq_frame_desc> depth() const {
    maq_frame_desc desc{};
    desc.struct_size = sizeof desc;
    const maq_status status = maq_frame_get_depth(get(), &desc);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return desc;
  }

  void copy_pixels(maq_pixel_format format, uint8_t* pixels, size_t stride_bytes, size_t size_bytes) const {
    check(maq_frame_copy_pixels(get(), format, pixels, stride_bytes, size_bytes));
  }

  // In BGR.
  Frame resized(int32_t width_px, int32_t height_px) const {
    maq_frame* made = nullptr;
    check(maq_frame_resize(get(), width_px, height_px, &made));
    return Frame(made);
  }

  void save(const std::string& path) const { check(maq_frame_save(get(), path.c_str())); }

 private:
  Owner<maq_frame, maq_frame_release> owner_;
};

class Source {
 public:
  Source(const Context& context, const std::string& uri, const maq_source_config* config = nullptr) {
    maq_source* made = nullptr;
    check(maq_source_create(context.get(), uri.c_str(), config, &made));
    owner_.reset(made);
  }

  maq_source* get() const { return owner_.get(); }

  maq_source_info info() const {
    maq_source_info info{};
    info.struct_size = sizeof info;
    check(maq_source_get_info(get(), &info));
    return info;
  }

  // Nothing when they are not known.
  std::optional<maq_intrinsics> intrinsics() const {
    maq_intrinsics intrinsics{};
    const maq_status status = maq_source_get_intrinsics(get(), &intrinsics);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return intrinsics;
  }

  // Nothing when the camera does not have it.
  std::optional<maq_control_info> control(maq_control which) const {
    maq_control_info info{};
    info.struct_size = sizeof info;
    const maq_status status = maq_source_get_control(get(), which, &info);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return info;
  }
  void set_control(maq_control which, double value) { check(maq_source_set_control(get(), which, value)); }

  void seek(int64_t time_ns) { check(maq_source_seek(get(), time_ns)); }

  // Nothing for sources other than cameras; readable while next() would not wait.
  std::optional<int> event_fd() const {
    int32_t fd = -1;
    const maq_status status = maq_source_get_event_fd(get(), &fd);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return fd;
  }

  // From any thread: next() returns nothing, now and later.
  void stop() { check(maq_source_stop(get())); }

  // Nothing after the last frame, and after stop(). Throws Error with MAQ_TIMEOUT when none came in time.
  std::optional<Frame> next(int64_t timeout_ns = MAQ_WAIT_FOREVER) {
    maq_frame* frame = nullptr;
    const maq_status status = maq_source_acquire_frame(get(), timeout_ns, &frame);
    if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) return std::nullopt;
    check(status);
    return Frame(frame);
  }

 private:
  Owner<maq_source, maq_source_destroy> owner_;
};

class Recorder {
 public:
  // `source` may be NULL, and so may `config`.
  Recorder(const Context& context, const std::string& path, const Source* source = nullptr,
           const maq_recorder_config* config = nullptr) {
    maq_recorder* made = nullptr;
    const maq_source* from = source == nullptr ? nullptr : source->get();
    check(maq_recorder_create(context.get(), path.c_str(), from, config, &made));
    owner_.reset(made);
  }

  maq_recorder* get() const { return owner_.get(); }
  void add(const Frame& frame) { check(maq_recorder_add_frame(get(), frame.get())); }
  void finish() { check(maq_recorder_finish(get())); }

  maq_recorder_info info() const {
    maq_recorder_info info{};
    info.struct_size = sizeof info;
    check(maq_recorder_get_info(get(), &info));
    return info;
  }

 private:
  Owner<maq_recorder, maq_recorder_destroy> owner_;
};

class Clip {
 public:
  Clip(const Context& context, const std::string& path, double fps) {
    maq_clip* made = nullptr;
    check(maq_clip_create(context.get(), path.c_str(), fps, &made));
    owner_.reset(made);
  }

  maq_clip* get() const { return owner_.get(); }
  void add(const Frame& frame) { check(maq_clip_add_frame(get(), frame.get())); }
  void finish() { check(maq_clip_finish(get())); }

 private:
  Owner<maq_clip, maq_clip_destroy> owner_;
};

class DensePoseResult {
 public:
  // Takes over a result of the C API.
  explicit DensePoseResult(maq_densepose_result* result) : owner_(result) {
    if (result != nullptr) check(maq_densepose_result_get_size(get(), &width_px_, &height_px_));
  }

  maq_densepose_result* get() const { return owner_.get(); }
  int32_t width_px() const { return width_px_; }
  int32_t height_px() const { return height_px_; }

  uint32_t person_count() const { return maq_densepose_result_get_person_count(get()); }

  maq_person person(uint32_t index) const {
    maq_person person{};
    person.struct_size = sizeof person;
    check(maq_densepose_result_get_person(get(), index, &person));
    return person;
  }

  std::vector<maq_person> people() const {
    std::vector<maq_person> people;
    for (uint32_t i = 0; i < person_count(); ++i) people.push_back(person(i));
    return people;
  }

  // height_px() rows of *stride_bytes.
  const uint8_t* plane(maq_densepose_plane plane, size_t* stride_bytes) const {
    const uint8_t* pixels = nullptr;
    check(maq_densepose_result_get_plane(get(), plane, &pixels, stride_bytes));
    return pixels;
  }

  maq_densepose_stats stats() const {
    maq_densepose_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_densepose_result_get_stats(get(), &stats));
    return stats;
  }

  // RGBA pixels of `drawing`, over `frame`, or on transparent ground where that is null.
  void draw(const Frame* frame, const maq_densepose_drawing& drawing, uint8_t* rgba, size_t stride_bytes,
            size_t size_bytes) const {
    check(maq_densepose_result_draw(get(), frame == nullptr ? nullptr : frame->get(), &drawing, rgba, stride_bytes,
                                    size_bytes));
  }

  void save(const std::string& folder, const std::string& stem) const {
    check(maq_densepose_result_save(get(), folder.c_str(), stem.c_str()));
  }

 private:
  Owner<maq_densepose_result, maq_densepose_result_release> owner_;
  int32_t width_px_ = 0;
  int32_t height_px_ = 0;
};

class DensePose {
 public:
  DensePose(const Context& context, const maq_densepose_config& config) { create(context, config); }
  // The bundle installed with the library.
  explicit DensePose(const Context& context) { create(context, default_densepose_config()); }
  DensePose(const Context& context, const std::string& bundle_path) {
    maq_densepose_config config = default_densepose_config();
    config.bundle_path = bundle_path.c_str();
    create(context, config);
  }

  maq_densepose* get() const { return owner_.get(); }

  DensePoseResult run(const Frame& frame) {
    maq_densepose_result* result = nullptr;
    check(maq_densepose_run(get(), frame.get(), &result));
    return DensePoseResult(result);
  }

  // From any thread: the run that runs, or else the next, throws Error with MAQ_CANCELLED.
  void cancel() { check(maq_densepose_cancel(get())); }

  void reset() { check(maq_densepose_reset(get())); }

  // Nothing when the bundle has none. The points are this object's.
  std::optional<maq_densepose_surface> surface() const {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_densepose_get_surface(get(), &surface);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return surface;
  }

 private:
  void create(const Context& context, const maq_densepose_config& config) {
    maq_densepose* made = nullptr;
    check(maq_densepose_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  Owner<maq_densepose, maq_densepose_destroy> owner_;
};

// Curves of a result, which may be released before them.
class EdgesCurves {
 public:
  // Takes over curves of the C API.
  explicit EdgesCurves(maq_edges_curves* curves) : owner_(curves) {}

  maq_edges_curves* get() const { return owner_.get(); }

  // Their pointers are this object's.
  std::vector<maq_edges_curve> curves() const {
    return items(maq_edges_curves_get_curve_count, maq_edges_curves_get_curve);
  }
  std::vector<maq_edges_corner> corners() const {
    return items(maq_edges_curves_get_corner_count, maq_edges_curves_get_corner);
  }
  // The largest first.
  std::vector<maq_edges_box> boxes() const { return items(maq_edges_curves_get_box_count, maq_edges_curves_get_box); }

  maq_edges_curves_stats stats() const {
    maq_edges_curves_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_edges_curves_get_stats(get(), &stats));
    return stats;
  }

  maq_edges_snap snap_to_pixel(double x_px, double y_px, double radius_px) const {
    maq_edges_snap snap{};
    snap.struct_size = sizeof snap;
    check(maq_edges_curves_snap_to_pixel(get(), x_px, y_px, radius_px, &snap));
    return snap;
  }
  maq_edges_snap snap_to_ray(const std::array<double, 3>& origin_m, const std::array<double, 3>& direction,
                             double max_angle_rad) const {
    maq_edges_snap snap{};
    snap.struct_size = sizeof snap;
    check(maq_edges_curves_snap_to_ray(get(), origin_m.data(), direction.data(), max_angle_rad, &snap));
    return snap;
  }

  void save(const std::string& path) const { check(maq_edges_curves_save(get(), path.c_str())); }

 private:
  template <class T>
  std::vector<T> items(uint32_t (*count)(const maq_edges_curves*),
                       maq_status (*read)(const maq_edges_curves*, uint32_t, T*)) const {
    std::vector<T> all(count(get()));
    for (uint32_t i = 0; i < all.size(); ++i) {
      all[i].struct_size = sizeof(T);
      check(read(get(), i, &all[i]));
    }
    return all;
  }

  Owner<maq_edges_curves, maq_edges_curves_release> owner_;
};

class EdgesResult {
 public:
  // Takes over a result of the C API.
  explicit EdgesResult(maq_edges_result* result) : owner_(result) {
    field_.struct_size = sizeof field_;
    check(maq_edges_result_get_field(get(), &field_));
  }

  maq_edges_result* get() const { return owner_.get(); }
  const maq_edges_field& field() const { return field_; }
  int32_t width_px() const { return field_.width_px; }
  int32_t height_px() const { return field_.height_px; }

  // width_px() * height_px() values, row by row.
  const float* distance_r() const { return static_cast<const float*>(plane(MAQ_EDGES_PLANE_DISTANCE)); }
  const float* spread_r() const { return static_cast<const float*>(plane(MAQ_EDGES_PLANE_SPREAD)); }
  const uint8_t* kind() const { return static_cast<const uint8_t*>(plane(MAQ_EDGES_PLANE_KIND)); }
  const float* depth_m() const { return static_cast<const float*>(plane(MAQ_EDGES_PLANE_DEPTH)); }

  std::vector<float> distance_m() const {
    std::vector<float> metres(size_t(width_px()) * size_t(height_px()));
    check(maq_edges_result_copy_distance_m(get(), metres.data(), metres.size()));
    return metres;
  }

  maq_edges_stats stats() const {
    maq_edges_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_edges_result_get_stats(get(), &stats));
    return stats;
  }

  EdgesCurves find_curves(const maq_edges_curves_config& config = default_edges_curves_config()) const {
    maq_edges_curves* curves = nullptr;
    check(maq_edges_result_find_curves(get(), &config, &curves));
    return EdgesCurves(curves);
  }

  void save(const std::string& folder, const std::string& stem) const {
    check(maq_edges_result_save(get(), folder.c_str(), stem.c_str()));
  }

 private:
  const void* plane(maq_edges_plane which) const {
    const void* values = nullptr;
    size_t stride_bytes = 0;
    check(maq_edges_result_get_plane(get(), which, &values, &stride_bytes));
    return values;
  }

  Owner<maq_edges_result, maq_edges_result_release> owner_;
  maq_edges_field field_{};
};

class Edges {
 public:
  Edges(const Context& context, const maq_edges_config& config) { create(context, config); }
  // The bundle installed with the library.
  explicit Edges(const Context& context) { create(context, default_edges_config()); }
  Edges(const Context& context, const std::string& bundle_path) {
    maq_edges_config config = default_edges_config();
    config.bundle_path = bundle_path.c_str();
    create(context, config);
  }

  maq_edges* get() const { return owner_.get(); }

  EdgesResult run(const Frame& frame, const maq_intrinsics& intrinsics) {
    maq_edges_result* result = nullptr;
    check(maq_edges_run(get(), frame.get(), &intrinsics, &result));
    return EdgesResult(result);
  }

  // From any thread: the run that runs, or else the next, throws Error with MAQ_CANCELLED.
  void cancel() { check(maq_edges_cancel(get())); }

 private:
  void create(const Context& context, const maq_edges_config& config) {
    maq_edges* made = nullptr;
    check(maq_edges_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  Owner<maq_edges, maq_edges_destroy> owner_;
};

inline maq_pipeline_config default_pipeline_config() {
  maq_pipeline_config config;
  check(maq_pipeline_config_init(&config, sizeof config));
  return config;
}

// A result of a pipeline with its frame.
struct PipelineResult {
  // Takes over what a callback or the C API gives.
  explicit PipelineResult(const maq_pipeline_result& result)
      : frame(result.frame),
        densepose(result.densepose),
        number(result.number),
        wait_ms(result.wait_ms),
        run_ms(result.run_ms),
        age_ms(result.age_ms) {
    if (result.curves != nullptr) curves.emplace(result.curves);
    if (result.edges != nullptr) edges.emplace(result.edges);
  }

  Frame frame;
  DensePoseResult densepose;          // get() is null where edges are found
  std::optional<EdgesResult> edges;   // nothing where dense pose runs
  std::optional<EdgesCurves> curves;  // nothing where they were not asked for
  uint64_t number;
  double wait_ms, run_ms, age_ms;
};

class Pipeline {
 public:
  Pipeline(const Context& context, const maq_pipeline_config& config) {
    maq_pipeline* made = nullptr;
    check(maq_pipeline_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  maq_pipeline* get() const { return owner_.get(); }

  void set_source(const std::string& uri) { check(maq_pipeline_set_source(get(), uri.c_str())); }
  void set_densepose(const maq_densepose_config& config) { check(maq_pipeline_set_densepose(get(), &config)); }
  // Edges in place of the current model; without curves where `curves` is null.
  void set_edges(const maq_edges_config& config, const maq_edges_curves_config* curves = nullptr) {
    check(maq_pipeline_set_edges(get(), &config, curves));
  }
  void set_paused(bool is_paused) { check(maq_pipeline_set_paused(get(), is_paused ? 1 : 0)); }
  // "" ends the recording.
  void set_recording(const std::string& path) {
    check(maq_pipeline_set_recording(get(), path.empty() ? nullptr : path.c_str()));
  }
  void stop() { check(maq_pipeline_stop(get())); }

  // Nothing after the last frame. Throws Error with MAQ_TIMEOUT when no result came in time.
  std::optional<PipelineResult> next(int64_t timeout_ns = MAQ_WAIT_FOREVER) {
    maq_pipeline_result result{};
    result.struct_size = sizeof result;
    const maq_status status = maq_pipeline_acquire_result(get(), timeout_ns, &result);
    if (status == MAQ_END_OF_STREAM) return std::nullopt;
    check(status);
    return PipelineResult(result);
  }

  // Its texts stay until this thread asks again.
  maq_pipeline_info info() const {
    maq_pipeline_info info{};
    info.struct_size = sizeof info;
    check(maq_pipeline_get_info(get(), &info));
    return info;
  }

  maq_pipeline_stats stats() const {
    maq_pipeline_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_pipeline_get_stats(get(), &stats));
    return stats;
  }

  // Nothing before a model is loaded, or when its bundle has none. The points are this object's.
  std::optional<maq_densepose_surface> surface() const {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_pipeline_get_surface(get(), &surface);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return surface;
  }

 private:
  Owner<maq_pipeline, maq_pipeline_destroy> owner_;
};

inline maq_scene_build_config default_scene_build_config() {
  maq_scene_build_config config;
  check(maq_scene_build_config_init(&config, sizeof config));
  return config;
}

inline maq_scene_renderer_config default_scene_renderer_config() {
  maq_scene_renderer_config config;
  check(maq_scene_renderer_config_init(&config, sizeof config));
  return config;
}

// Edges of several views as one: see edges_fusion.h.
class EdgesFusion {
 public:
  explicit EdgesFusion(const Context& context, const maq_edges_fusion_config& config = default_edges_fusion_config()) {
    maq_edges_fusion* created = nullptr;
    check(maq_edges_fusion_create(context.get(), &config, &created));
    owner_.reset(created);
  }

  maq_edges_fusion* get() const { return owner_.get(); }

  void add_view(const EdgesResult& result, const maq_pinhole_camera& camera) {
    check(maq_edges_fusion_add_view(get(), result.get(), &camera));
  }
  void finish() { check(maq_edges_fusion_finish(get())); }
  void cancel() { check(maq_edges_fusion_cancel(get())); }

  maq_edges_fusion_info info() const {
    maq_edges_fusion_info info{};
    info.struct_size = sizeof info;
    check(maq_edges_fusion_get_info(get(), &info));
    return info;
  }
  std::vector<maq_edges_fusion_point> points() const {
    std::vector<maq_edges_fusion_point> points(size_t(info().point_count));
    check(maq_edges_fusion_copy_points(get(), points.data(), points.size()));
    return points;
  }
  EdgesCurves find_curves() const {
    maq_edges_curves* curves = nullptr;
    check(maq_edges_fusion_find_curves(get(), &curves));
    return EdgesCurves(curves);
  }

 private:
  Owner<maq_edges_fusion, maq_edges_fusion_destroy> owner_;
};

class Capture {
 public:
  Capture(const Context& context, const std::string& folder) {
    maq_capture* opened = nullptr;
    check(maq_capture_open(context.get(), folder.c_str(), &opened));
    owner_.reset(opened);
  }

  maq_capture* get() const { return owner_.get(); }

  maq_capture_info info() const {
    maq_capture_info info{};
    info.struct_size = sizeof info;
    check(maq_capture_get_info(get(), &info));
    return info;
  }

  // Its texts are the capture's.
  maq_capture_view view(uint32_t index) const {
    maq_capture_view view{};
    view.struct_size = sizeof view;
    check(maq_capture_get_view(get(), index, &view));
    return view;
  }

  // Its text is the capture's.
  maq_capture_drop drop(uint32_t index) const {
    maq_capture_drop drop{};
    drop.struct_size = sizeof drop;
    check(maq_capture_get_drop(get(), index, &drop));
    return drop;
  }

  // With its camera.
  std::pair<Frame, maq_pinhole_camera> load_depth(uint32_t index) const {
    maq_frame* frame = nullptr;
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    check(maq_capture_load_depth(get(), index, &camera, &frame));
    return {Frame(frame), camera};
  }

  // BGR, undistorted.
  Frame load_view(uint32_t index) const {
    maq_frame* frame = nullptr;
    check(maq_capture_load_view(get(), index, &frame));
    return Frame(frame);
  }

 private:
  Owner<maq_capture, maq_capture_close> owner_;
};

class Scene {
 public:
  // Takes over a scene of the C API.
  explicit Scene(maq_scene* scene) : owner_(scene) {}

  Scene(const Context& context, const std::string& path) {
    maq_scene* opened = nullptr;
    check(maq_scene_open(context.get(), path.c_str(), &opened));
    owner_.reset(opened);
  }

  // A scene file in memory, which is copied.
  Scene(const Context& context, const void* data, size_t size_bytes) {
    maq_scene* opened = nullptr;
    check(maq_scene_open_memory(context.get(), data, size_bytes, &opened));
    owner_.reset(opened);
  }

  // `stats` may be null.
  Scene(const Context& context, const maq_scene_build_config& config, const Capture& capture,
        maq_scene_build_stats* stats = nullptr) {
    if (stats != nullptr) stats->struct_size = sizeof *stats;
    maq_scene* built = nullptr;
    check(maq_scene_build(context.get(), &config, capture.get(), stats, &built));
    owner_.reset(built);
  }

  maq_scene* get() const { return owner_.get(); }

  void save(const std::string& path) const { check(maq_scene_save(get(), path.c_str())); }
  void save_ply(const std::string& path) const { check(maq_scene_save_ply(get(), path.c_str())); }

  maq_scene_info info() const {
    maq_scene_info info{};
    info.struct_size = sizeof info;
    check(maq_scene_get_info(get(), &info));
    return info;
  }

 private:
  Owner<maq_scene, maq_scene_close> owner_;
};

class SceneBuilder {
 public:
  SceneBuilder(const Context& context, const maq_scene_build_config& config, const maq_point_cloud& cloud) {
    maq_scene_builder* made = nullptr;
    check(maq_scene_builder_create(context.get(), &config, &cloud, &made));
    owner_.reset(made);
  }

  maq_scene_builder* get() const { return owner_.get(); }

  // Returns how many points the photo saw.
  uint64_t add_view(const Frame& photo, const maq_pinhole_camera& camera) {
    uint64_t seen_point_count = 0;
    check(maq_scene_builder_add_view(get(), photo.get(), &camera, &seen_point_count));
    return seen_point_count;
  }

  void cancel() { check(maq_scene_builder_cancel(get())); }

  maq_scene_build_stats stats() const {
    maq_scene_build_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_scene_builder_get_stats(get(), &stats));
    return stats;
  }

  Scene finish() {
    maq_scene* scene = nullptr;
    check(maq_scene_builder_finish(get(), &scene));
    return Scene(scene);
  }

 private:
  Owner<maq_scene_builder, maq_scene_builder_destroy> owner_;
};

class SceneImage {
 public:
  // Takes over an image of the C API.
  explicit SceneImage(maq_scene_image* image) : owner_(image) {}

  maq_scene_image* get() const { return owner_.get(); }

  // Rows of *stride_bytes.
  const void* plane(maq_scene_plane plane, size_t* stride_bytes) const {
    const void* pixels = nullptr;
    check(maq_scene_image_get_plane(get(), plane, &pixels, stride_bytes));
    return pixels;
  }

  maq_scene_image_stats stats() const {
    maq_scene_image_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_scene_image_get_stats(get(), &stats));
    return stats;
  }

  void save(const std::string& path, bool with_alpha = false) const {
    check(maq_scene_image_save(get(), path.c_str(), with_alpha ? 1 : 0));
  }

 private:
  Owner<maq_scene_image, maq_scene_image_release> owner_;
};

class SceneRenderer {
 public:
  SceneRenderer(const Context& context, const maq_scene_renderer_config& config, const Scene& scene) {
    maq_scene_renderer* made = nullptr;
    check(maq_scene_renderer_create(context.get(), &config, scene.get(), &made));
    owner_.reset(made);
  }

  maq_scene_renderer* get() const { return owner_.get(); }

  SceneImage run(const maq_pinhole_camera& camera) {
    maq_scene_image* image = nullptr;
    check(maq_scene_renderer_run(get(), &camera, &image));
    return SceneImage(image);
  }

 private:
  Owner<maq_scene_renderer, maq_scene_renderer_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_MAQUETTE_HPP_
