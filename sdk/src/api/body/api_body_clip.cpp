#include "api/body/body_handle.h"
#include "api/boundary.h"
#include "body/files/body_bvh.h"
#include "body/files/body_glb.h"
#include "core/files/atomic_file.h"
#include "core/files/file.h"

using namespace maq;

namespace {

template <class Bytes>
void write_whole(const char* path, const Bytes& bytes) {
  AtomicFile file(path);
  file.append(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace

maq_status maq_body_clip_create(maq_body* body, maq_body_clip** clip) {
  return guarded(body, __func__, [&] {
    require_argument(body, "body");
    require_argument(clip, "clip");
    *clip = new maq_body_clip(body->model);
    return MAQ_OK;
  });
}

void maq_body_clip_destroy(maq_body_clip* clip) { destroy(clip, "clip", __func__); }

maq_status maq_body_clip_add_result(maq_body_clip* clip, const maq_body_result* result) {
  return guarded_alone(clip, "clip", __func__, [&] {
    require_argument(result, "result");
    if (result->model != clip->model) throw ArgumentError("result and clip come from two bodies; use one for both.");
    for (size_t i = 0; i < result->count; ++i) {
      const BodyOfPerson& person = result->people[i];
      if (person.fitted.status != body::FitStatus::kFitted) continue;
      body::ClipPose pose{result->timestamp_ns, person.fitted.pose};
      pose.pose.place = person.place_m;
      clip->clip.add(person.id, pose);
    }
    return MAQ_OK;
  });
}

uint32_t maq_body_clip_get_person_count(const maq_body_clip* clip) {
  return clip == nullptr ? 0 : uint32_t(clip->clip.people().size());
}

maq_status maq_body_clip_save(maq_body_clip* clip, const char* path) {
  return guarded_alone(clip, "clip", __func__, [&] {
    require_argument(path, "path");
    if (lower_case_extension(path) != ".glb") {
      throw ArgumentError("path is \"", path,
                          "\", but must end with .glb; maq_body_clip_save_person also writes .bvh.");
    }
    const auto people = clip->clip.people();
    if (people.empty()) throw Error(MAQ_ERROR_NOT_FOUND, "The clip has no people; add a result with a fitted person.");
    write_whole(path, people_as_glb(*clip->model, people));
    return MAQ_OK;
  });
}

maq_status maq_body_clip_save_person(maq_body_clip* clip, uint32_t index, const char* path) {
  return guarded_alone(clip, "clip", __func__, [&] {
    require_argument(path, "path");
    const auto people = clip->clip.people();
    require_index("index", index, people.size());
    const std::string extension = lower_case_extension(path);
    if (extension == ".glb") {
      write_whole(path, people_as_glb(*clip->model, {people[index]}));
    } else if (extension == ".bvh") {
      write_whole(path, person_as_bvh(*clip->model, *people[index]));
    } else {
      throw ArgumentError("path is \"", path, "\", but must end with .glb or .bvh.");
    }
    return MAQ_OK;
  });
}
