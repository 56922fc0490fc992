#include "scene/build/build_scene.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "scene/capture/posed_photo.h"
#include "scene/capture/posed_view.h"

namespace maq {
namespace {

// The share of the work that is left when all photos have been looked at.
constexpr double kSolvingShare = 0.05;

std::vector<const CaptureView*> chosen_views(const Capture& capture, const CaptureBuildOptions& options) {
  std::vector<const CaptureView*> views;
  for (const CaptureView& view : capture.views) {
    if (!view.is_held_out || options.uses_held_out) views.push_back(&view);
  }
  if (views.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "All of the capture's ", capture.views.size(),
                " photos are held out; a scene needs one.");
  }
  const size_t count = options.most_views == 0 ? views.size() : std::min(views.size(), options.most_views);
  std::vector<const CaptureView*> even;
  for (size_t i = 0; i < count; ++i) even.push_back(views[i * views.size() / count]);
  return even;
}

// Why a photo cannot be used; null for errors that are not the photo's.
const char* fault_of_photo(maq_status status) {
  switch (status) {
    case MAQ_ERROR_NOT_FOUND: return kPhotosMissing;
    case MAQ_ERROR_UNREADABLE: return kPhotosUnreadable;
    case MAQ_ERROR_IMAGE_SIZE: return "photos that are too large for the networks";
    default: return nullptr;
  }
}

}  // namespace

std::optional<BuiltCapture> build_from_capture(Capture capture, SceneNetworks& networks,
                                               const CaptureBuildOptions& options, const BuildProgress& progress) {
  if (options.long_side_px < 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The photos' long side is to be ", options.long_side_px,
                " pixels; it must be positive, or 0 for photos as they are.");
  }
  const std::vector<const CaptureView*> views = chosen_views(capture, options);
  SceneBuilder builder(std::move(capture.cloud), capture.up, networks, options.points);
  BuiltCapture built;
  DropCounts drops;
  PosedView photo;
  for (size_t i = 0; i < views.size(); ++i) {
    const CaptureView& view = *views[i];
    const auto in_all = [&](double done, const std::string& what) {
      const double share = (1 - kSolvingShare) * (double(i) + done) / double(views.size());
      return !progress ||
             progress(share, "Photo " + std::to_string(i + 1) + " of " + std::to_string(views.size()) + ": " + what);
    };
    try {
      const Stopwatch watch;
      photo.load(view, options.long_side_px);
      built.loading_ms += watch.elapsed_ms();
      const auto seen = builder.add_view(photo.image(), photo.valid(), photo.camera(), in_all);
      if (!seen) return {};
      if (*seen == 0) drops.add("photos that see no point of the cloud", view.name);
    } catch (const Error& error) {
      const char* reason = fault_of_photo(error.status());
      if (reason == nullptr) throw;
      drops.add(reason, view.name);
    }
  }
  built.dropped = drops.list();
  built.views = builder.views();
  if (built.views == 0) {
    std::string text;
    for (const Dropped& dropped : built.dropped) text += (text.empty() ? "" : ", ") + sentence_part(dropped);
    throw Error(MAQ_ERROR_UNREADABLE, "None of the photos can be used: ", text, ".");
  }
  if (progress && !progress(1 - kSolvingShare, "Solving for how the points look.")) return {};
  built.points = builder.finish_and_forget();
  built.times = builder.times();
  if (progress) progress(1, "The points know how they look.");
  return built;
}

}  // namespace maq
