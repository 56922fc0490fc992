#include <algorithm>
#include <memory>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/frame_handle.h"
#include "api/head/head_handle.h"
#include "api/model_options.h"
#include "core/worker_threads.h"
#include "head/reconstruction/head_builder.h"
#include "nn/provider.h"

using namespace maq;

namespace {

constexpr int kDefaultTexture_px = 1024;

maq_head_builder_config default_head_builder_config() {
  maq_head_builder_config config{};
  config.struct_size = sizeof config;
  return config;
}

maq_head_photo default_photo() {
  maq_head_photo photo{};
  photo.struct_size = sizeof photo;
  return photo;
}

head::TextureOptions texture_options(const maq_head_builder_config& config) {
  require_range("config.texture", number_in(config.texture), int32_t(MAQ_HEAD_TEXTURE_DEFAULT),
                int32_t(MAQ_HEAD_TEXTURE_ON));
  require_range("config.delight_texture", config.delight_texture, 0, 1);
  head::TextureOptions options{kDefaultTexture_px, config.delight_texture == 1};
  if (config.texture_px != 0) {
    require_range("config.texture_px", config.texture_px, uint32_t(head::kMinTexture_px),
                  uint32_t(head::kMaxTexture_px));
    options.side_px = int(config.texture_px);
  }
  if (config.texture != MAQ_HEAD_TEXTURE_OFF) return options;
  if (config.texture_px != 0 || options.delight) {
    throw ArgumentError(
        "config.texture_px or delight_texture is set, but config.texture is MAQ_HEAD_TEXTURE_OFF; leave them 0, or "
        "allow a texture.");
  }
  options.side_px = 0;
  return options;
}

// The stage of a fit when the fraction `done` is finished.
const char* stage_of_fit(double done) {
  if (done <= 0) return "Finding cameras and a first shape.";
  return done < 1 ? "Fitting shape and colours to the pixels." : "The head is fitted.";
}

}  // namespace

struct maq_head_builder : HandleOf<HandleKind::kHeadBuilder> {
  maq_head_builder(std::shared_ptr<ContextState> of, std::unique_ptr<head::HeadBuilder> made,
                   head::HeadBuilder::Progress wanted)
      : state(std::move(of)), builder(std::move(made)), progress(std::move(wanted)) {}
  std::shared_ptr<ContextState> state;
  std::unique_ptr<head::HeadBuilder> builder;
  head::HeadBuilder::Progress progress;  // may be empty
};

maq_status maq_head_builder_config_init(maq_head_builder_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_head_builder_config());
}

maq_status maq_head_photo_init(maq_head_photo* photo, uint32_t struct_size) {
  return init_config(__func__, photo, struct_size, default_photo(), "photo");
}

maq_status maq_head_builder_create(maq_context* context, const maq_head_builder_config* given,
                                   maq_head_builder** builder) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(builder, "builder");
    const maq_head_builder_config config = read_config(given, "config", default_head_builder_config());
    require_model_options("config.model", config.model);
    const head::TextureOptions texture = texture_options(config);
    Bundle bundle = read_bundle_argument(config.model, "config.model", kHeadsBundle);
    const Manifest manifest = bundle.manifest;
    const auto runtime = context->state->onnxruntime();
    SessionSettings settings;
    settings.threads = config.model.threads != 0 ? config.model.threads : default_threads();
    settings.provider = available_provider(*runtime, config.model.provider);
    auto made = std::make_unique<head::HeadBuilder>(runtime, std::move(bundle), settings, texture);
    context->state->log().write(MAQ_LOG_INFO, "Bundle ", manifest.name, " ", manifest.version, " (", manifest.precision,
                                ") loaded, ", made->threads(), " thread(s)");
    head::HeadBuilder::Progress progress;
    if (config.progress_callback != nullptr) {
      progress = [callback = config.progress_callback, user_data = config.progress_user_data](double done) {
        const auto call = [&] { return callback(user_data, done, stage_of_fit(done)); };
        return call_app("config.progress_callback", call) != 0;
      };
    }
    *builder = new maq_head_builder(context->state, std::move(made), std::move(progress));
    return MAQ_OK;
  });
}

void maq_head_builder_destroy(maq_head_builder* builder) { destroy(builder, "builder", __func__); }

maq_status maq_head_builder_add_photo(maq_head_builder* builder, const maq_frame* frame, const maq_head_photo* photo) {
  return guarded_alone(builder, "builder", __func__, [&] {
    require_argument(frame, "frame");
    const maq_head_photo known = read_config(photo, "photo", default_photo());
    head::PhotoHints hints;
    std::copy_n(known.box_px, 4, hints.box_px.begin());
    hints.roll_rad = double(known.roll_rad);
    hints.focal_px = double(known.focal_px);
    builder->builder->add_photo(frame->frame.image, hints);
    return MAQ_OK;
  });
}

maq_status maq_head_builder_add_head(maq_head_builder* builder, const maq_head* head) {
  return guarded_alone(builder, "builder", __func__, [&] {
    require_argument(head, "head");
    builder->builder->add_head(head->head);
    return MAQ_OK;
  });
}

maq_status maq_head_builder_clear(maq_head_builder* builder) {
  return guarded_alone(builder, "builder", __func__, [&] {
    builder->builder->clear();
    return MAQ_OK;
  });
}

maq_status maq_head_builder_fit(maq_head_builder* builder, double seconds, maq_head** head) {
  return guarded_alone(builder, "builder", __func__, [&] {
    require_argument(head, "head");
    head::StoredHead fitted = builder->builder->fit(seconds, builder->progress);
    *head = new maq_head(std::move(fitted), builder->builder->threads(), builder->builder->template_head());
    return MAQ_OK;
  });
}

maq_status maq_head_builder_cancel(maq_head_builder* builder) {
  return guarded(builder, __func__, [&] {
    require_argument(builder, "builder");
    builder->builder->cancel();
    return MAQ_OK;
  });
}

maq_status maq_head_builder_set_preview(maq_head_builder* builder, double interval_s, maq_head_preview_callback preview,
                                        void* user_data) {
  return guarded_alone(builder, "builder", __func__, [&] {
    head::HeadBuilder::Preview pass_on;
    if (preview != nullptr) {
      pass_on = [=](head::StoredHead head) {
        auto* const made =
            new maq_head(std::move(head), builder->builder->threads(), builder->builder->template_head());
        call_app("preview", [&] { preview(user_data, made); });
      };
    }
    builder->builder->set_preview(interval_s, std::move(pass_on));
    return MAQ_OK;
  });
}

maq_status maq_head_builder_get_stats(const maq_head_builder* builder, maq_head_build_stats* stats) {
  return guarded_alone(builder, "builder", __func__, [&] {
    const head::HeadBuildStats& from = builder->builder->stats();
    maq_head_build_stats filled{};
    filled.photo_count = uint32_t(builder->builder->photo_count());
    filled.used_photo_count = uint32_t(from.used_photos);
    filled.encode_ms = float(from.encode_ms);
    filled.pose_ms = float(from.pose_ms);
    filled.fit_ms = float(from.fit_ms);
    filled.total_ms = float(from.total_ms);
    filled.step_count = from.steps;
    filled.provider = builder->builder->provider();
    filled.threads = builder->builder->threads();
    write_struct(stats, "stats", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_builder_get_photo(const maq_head_builder* builder, uint32_t index, maq_head_photo_info* info) {
  return guarded_alone(builder, "builder", __func__, [&] {
    require_index("index", index, builder->builder->photo_count());
    const head::PhotoFound& from = builder->builder->found(index);
    maq_head_photo_info filled{};
    std::copy(from.box_px.begin(), from.box_px.end(), filled.box_px);
    filled.head_coverage = float(from.head_coverage);
    filled.is_used = from.is_used ? 1 : 0;
    filled.focal_px = float(from.focal_px);
    filled.rms_px = float(from.rms_px);
    write_struct(info, "info", filled);
    return MAQ_OK;
  });
}
