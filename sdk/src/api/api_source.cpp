#include "api/boundary.h"

using namespace maq;

namespace {

constexpr uint32_t kDefaultPoolSize = 4;
constexpr uint32_t kLargestPoolSize = 64;

maq_source_config default_config() {
  maq_source_config config{};
  config.struct_size = sizeof config;
  config.pool_size = kDefaultPoolSize;
  return config;
}

}  // namespace

maq_status maq_source_config_init(maq_source_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_config(), sizeof(maq_source_config));
}

maq_status maq_source_create(maq_context* context, const char* uri, const maq_source_config* given,
                             maq_source** source) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(uri, "uri");
    require_argument(source, "source");
    const maq_source_config config = read_config(given, "config", default_config(), sizeof(maq_source_config));
    require_range("config.pool_size", config.pool_size, 1u, kLargestPoolSize);
    *source = new maq_source(open_source(uri), config.pool_size);
    return MAQ_OK;
  });
}

void maq_source_destroy(maq_source* source) { delete source; }

maq_status maq_source_get_info(const maq_source* source, maq_source_info* info) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    const SourceInfo& from = source->source->info();
    maq_source_info filled{};
    filled.width_px = from.width_px;
    filled.height_px = from.height_px;
    filled.fps = from.fps;
    filled.frame_count = from.frame_count;
    filled.is_live = from.is_live ? 1 : 0;
    filled.clock = from.clock;
    filled.pool_size = uint32_t(source->frames.capacity());
    write_struct(info, "info", filled, sizeof(maq_source_info));
    return MAQ_OK;
  });
}

maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    require_argument(frame, "frame");
    BoundedPool<maq_frame>::Pooled handle = source->frames.acquire();
    if (!source->source->next(timeout_ns, handle->frame)) return MAQ_END_OF_STREAM;
    *frame = hand_out<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

uint32_t maq_source_scheme_count(void) {
  try {
    return uint32_t(source_schemes().size());
  } catch (...) {
    return 0;
  }
}

maq_status maq_source_get_scheme(uint32_t index, maq_source_scheme* scheme) {
  return guarded(nullptr, __func__, [&] {
    const std::vector<SourceScheme>& schemes = source_schemes();
    require_range("index", index, 0u, uint32_t(schemes.size() - 1));
    const SourceScheme& from = schemes[index];
    write_struct(scheme, "scheme", maq_source_scheme{0, from.name, from.example, from.summary},
                 sizeof(maq_source_scheme));
    return MAQ_OK;
  });
}
