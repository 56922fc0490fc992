#include <cstddef>

#include "api/boundary.h"
#include "api/source_handle.h"
#include "maquette/recorder.h"
#include "sources/recording/recording.h"

using namespace maq;

struct maq_recorder : HandleOf<HandleKind::kRecorder> {
  maq_recorder(const char* path, const RecordingInfo& info, const maq_recorder_config& config)
      : writer(path, info, int(config.jpeg_quality), config.keep_predicted == 1) {}
  RecordingWriter writer;
};

maq_status maq_recorder_config_init(maq_recorder_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, maq_recorder_config{});
}

maq_status maq_recorder_create(maq_context* context, const char* path, const maq_source* source,
                               const maq_recorder_config* given, maq_recorder** recorder) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(path, "path");
    require_argument(recorder, "recorder");
    const maq_recorder_config config = read_config(given, "config", maq_recorder_config{});
    require_range("config.jpeg_quality", config.jpeg_quality, 0u, 100u);
    require_range("config.keep_predicted", config.keep_predicted, 0, 1);
    RecordingInfo info;
    if (source != nullptr) {
      require_argument(source, "source");
      info.source = source->uri;
      info.fps = source->source->info().fps;
      if (source->source->intrinsics() != nullptr) info.intrinsics = *source->source->intrinsics();
    }
    *recorder = new maq_recorder(path, info, config);
    return MAQ_OK;
  });
}

maq_status maq_recorder_add_frame(maq_recorder* recorder, const maq_frame* frame) {
  return guarded_alone(recorder, "recorder", __func__, [&] {
    require_argument(frame, "frame");
    recorder->writer.add(frame->frame);
    return MAQ_OK;
  });
}

maq_status maq_recorder_finish(maq_recorder* recorder) {
  return guarded_alone(recorder, "recorder", __func__, [&] {
    recorder->writer.finish();
    return MAQ_OK;
  });
}

maq_status maq_recorder_get_info(const maq_recorder* recorder, maq_recorder_info* info) {
  return guarded_alone(recorder, "recorder", __func__, [&] {
    write_struct(info, "info", maq_recorder_info{0, recorder->writer.frame_count(), recorder->writer.size_bytes()});
    return MAQ_OK;
  });
}

void maq_recorder_destroy(maq_recorder* recorder) { destroy(recorder, "recorder", __func__); }
