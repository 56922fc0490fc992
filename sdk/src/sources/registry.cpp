#include "core/error.h"
#include "sources/file_sources.h"
#include "sources/source.h"
#include "sources/stub_sources.h"
#include "sources/uri.h"
#include "sources/v4l2_camera.h"
#include "sources/v4l2_source.h"

namespace maq {
namespace {

struct Entry {
  SourceScheme scheme;
  std::unique_ptr<Source> (*open)(SourceUri uri, const SourceSettings& settings);
};

// Files and stubs need none.
template <std::unique_ptr<Source> (*open)(SourceUri uri)>
std::unique_ptr<Source> without_settings(SourceUri uri, const SourceSettings&) {
  return open(std::move(uri));
}

const Entry kEntries[] = {
    {{"image", "image:photo.jpg", "one image file: JPEG, PNG, WebP, BMP or TIFF"},
     &without_settings<open_image_source>},
    {{"video", "video:clip.mp4", "a video file, frame by frame; ?fps=10 thins it out"},
     &without_settings<open_video_source>},
    {{"stub", "stub:people?count=2&fps=30&seed=7",
      "frames without a camera: people (rendered people who walk; count, seed, frames) or pattern (colour bars)"},
     &without_settings<open_stub_source>},
    {{"v4l2", "v4l2:/dev/video0?size=640x480&fps=30",
      "a camera of Linux; the nearest size and rate that it offers; ?format=MJPG&exposure=10000 (microseconds)"},
     &open_v4l2_source},
};

}  // namespace

const std::vector<SourceScheme>& source_schemes() {
  static const std::vector<SourceScheme> schemes = [] {
    std::vector<SourceScheme> list;
    for (const Entry& entry : kEntries) list.push_back(entry.scheme);
    return list;
  }();
  return schemes;
}

std::vector<CameraListing> list_cameras() { return list_v4l2_cameras(SystemCalls::real()); }

std::unique_ptr<Source> open_source(const std::string& text, const SourceSettings& settings) {
  SourceUri uri = parse_source_uri(text);
  for (const Entry& entry : kEntries) {
    if (uri.scheme == entry.scheme.name) {
      if (uri.target.empty()) {
        throw Error(MAQ_ERROR_INVALID_ARGUMENT, "\"", text, "\" names nothing after ", uri.scheme, ":, as in ",
                    entry.scheme.example, ".");
      }
      return entry.open(std::move(uri), settings);
    }
  }
  std::string known;
  for (const Entry& entry : kEntries) known += std::string(known.empty() ? "" : ", ") + entry.scheme.name + ":";
  throw Error(MAQ_ERROR_UNSUPPORTED, "\"", uri.scheme, ":\" is not a kind of source of this build; there are ", known,
              ".");
}

}  // namespace maq
