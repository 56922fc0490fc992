#include "api/boundary.h"
#include "api/frame_handle.h"
#include "image/clips/clip_writer.h"
#include "maquette/clip.h"

using namespace maq;

struct maq_clip : HandleOf<HandleKind::kClip> {
  maq_clip(const char* path, double fps) : file(path, fps) {}
  ClipWriter file;
};

maq_status maq_clip_create(maq_context* context, const char* path, double fps, maq_clip** clip) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(path, "path");
    require_argument(clip, "clip");
    require_range("fps", fps, kMinClipFps, kMaxClipFps);
    *clip = new maq_clip(path, fps);
    return MAQ_OK;
  });
}

maq_status maq_clip_add_frame(maq_clip* clip, const maq_frame* frame) {
  return guarded_alone(clip, "clip", __func__, [&] {
    require_argument(frame, "frame");
    clip->file.add(frame->frame.image);
    return MAQ_OK;
  });
}

maq_status maq_clip_finish(maq_clip* clip) {
  return guarded_alone(clip, "clip", __func__, [&] {
    clip->file.finish();
    return MAQ_OK;
  });
}

void maq_clip_destroy(maq_clip* clip) { destroy(clip, "clip", __func__); }
