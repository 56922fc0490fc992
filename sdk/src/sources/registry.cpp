#include "sources/registry.h"

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "core/files/file.h"
#include "sources/calibration_options.h"
#include "sources/control_options.h"
#include "sources/files/file_sources.h"
#include "sources/live_source.h"
#include "sources/recording/recording.h"
#include "sources/synthetic/fault_injection.h"
#include "sources/synthetic/replay_camera.h"
#include "sources/synthetic/stub_source.h"
#include "sources/uri.h"
#if defined(__ANDROID__)
#include "sources/android/camera2_camera.h"
#elif !defined(_WIN32)
#include "sources/depthai/depthai_backend.h"
#include "sources/libcamera/module_client.h"
#include "sources/v4l2/v4l2_camera.h"
#endif

namespace maq {
namespace {

template <std::unique_ptr<Source> (*open)(SourceUri uri)>
std::unique_ptr<Source> without_log(SourceUri uri, const Log&) {
  return open(std::move(uri));
}

// A kind of source: opens a source itself, or makes the opener of its cameras.
struct Entry {
  SourceScheme scheme;
  std::unique_ptr<Source> (*open)(SourceUri uri, const Log& log);
  CameraOpener (*camera)(SourceUri uri, int buffers, const Log& log);
  bool needs_target = true;  // false: without a target, the first one that is found
};

// Entries that stand for one of the others.
constexpr char kFile[] = "file", kCamera[] = "camera";

const Entry kEntries[] = {
    {{kFile, "file:clip.mp4", "an image, a video file or a recording, by its content"}, nullptr, nullptr},
    {{kCamera, "camera:?size=640x480", "the first camera below that can be opened"}, nullptr, nullptr, false},
    {{"image", "image:photo.jpg",
      "one image file: JPEG, PNG, WebP, BMP or TIFF; ?depth_unit=0.001&fov=60: depth, a PNG of 16 bits or a float "
      "TIFF"},
     without_log<open_image_source>,
     nullptr},
    {{"video", "video:clip.mp4", "a video file; ?fps=10 drops frames down to that rate"},
     without_log<open_video_source>,
     nullptr},
    {{"rec", "rec:take.maqrec?from=10&to=20", "a recording (maquette record), with its times and depth"},
     open_recording_source,
     nullptr},
    {{"stub", "stub:people?count=2&fps=30&seed=7",
      "rendered frames: people (who walk; count, seed, frames), pattern (colour bars) or solids (depth; scene=box, "
      "wall, shelf or room; noise=none, stereo or tof; seed)"},
     without_log<open_stub_source>,
     nullptr},
#ifdef __ANDROID__
    {{"android", "android:back?size=640x480&fps=30",
      "a camera of Android (Camera2), by number, id or direction: back, front or external"},
     nullptr,
     android_uri_opener},
#elif !defined(_WIN32)
    {{"v4l2", "v4l2:/dev/video0?size=640x480&fps=30",
      "a camera on Linux (Video4Linux2); takes the nearest size and rate that it offers; ?format=MJPG&exposure=10000 "
      "(microseconds); ?format=Z16&depth_unit=0.001&fov=60: depth"},
     nullptr,
     v4l2_uri_opener},
    {{"libcamera", "libcamera:0?size=640x480&fps=30",
      "a libcamera camera (Raspberry Pi and other boards), by number or id; ?format=NV12"},
     nullptr,
     libcamera_uri_opener},
    {{"depthai", "depthai:?size=640x480&fps=30",
      "an OAK camera with depth, the first one or depthai:<id or IP>; ?depth=0: colour only"},
     nullptr,
     depthai_uri_opener,
     false},
#endif
};

const Entry* find_entry(const std::string& scheme) {
  const auto found = std::find_if(std::begin(kEntries), std::end(kEntries),
                                  [&](const Entry& entry) { return scheme == entry.scheme.name; });
  return found == std::end(kEntries) ? nullptr : found;
}

// Opens a source that is not a camera. Images larger than the settings allow are scaled down; `uri` keeps the size.
std::unique_ptr<Source> open_within(const Entry& entry, SourceUri& uri, const SourceSettings& settings) {
  std::unique_ptr<Source> source = entry.open(uri, settings.log);
  const SourceInfo& info = source->info();
  const int side_px = std::max(info.width_px, info.height_px);
  if (settings.max_side_px == 0 || side_px <= settings.max_side_px) return source;
  const double scale = double(settings.max_side_px) / side_px;
  uri.width_px = std::max(1, int(info.width_px * scale));
  uri.height_px = std::max(1, int(info.height_px * scale));
  source.reset();
  return entry.open(uri, settings.log);
}

// A camera that replays a source. `opened`: that source, for the first time that it is needed.
CameraOpener replay_opener(const Entry& entry, SourceUri uri, std::unique_ptr<Source> opened,
                           const ReplayOptions& options, const Log& log) {
  std::string identity = uri.scheme + ":" + uri.target;
  const auto first = std::make_shared<std::unique_ptr<Source>>(std::move(opened));
  const auto open = [&entry, uri = std::move(uri), log, first] {
    return *first != nullptr ? std::move(*first) : entry.open(uri, log);
  };
  return replay_as_camera(open, std::move(identity), options);
}

// Faults happen in time, so that a file or a stub with faults is replayed as a camera.
bool takes_live(SourceUri& uri, const SourceSettings& settings, bool has_faults) {
  const bool is_given = uri.options.count("live") > 0;
  const bool is_live = uri.take_integer("live", has_faults || settings.real_time ? 1 : 0, 0, 1) == 1;
  if (is_given && !is_live && has_faults) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "live=0 in ", uri.text, " does not go with ", kFaultOptions, ".");
  }
  return is_live;
}

// Opens a scheme that does not stand for another.
std::unique_ptr<Source> open_entry(const Entry& entry, SourceUri uri, const SourceSettings& settings) {
  const FaultPlan faults = take_faults(uri);
  const bool is_path = entry.camera != nullptr && uri.target.rfind('/', 0) == 0;
  const std::string name = is_path ? uri.target : uri.scheme + ":" + uri.target;
  // Buffers that the app holds, buffers that wait for it, one that is handed over, and one that the device fills.
  const int buffers = settings.pool_size + settings.queue_length + 2;
  std::vector<ControlSetting> controls;
  CalibrationOptions calibration;
  CameraOpener opener;
  if (entry.camera != nullptr) {
    controls = take_control_options(uri);
    calibration = CalibrationOptions(uri);
    opener = entry.camera(std::move(uri), buffers, settings.log);
  } else {
    const bool must_be_live = !faults.is_empty() || uri.options.count("live") > 0;
    if (!takes_live(uri, settings, !faults.is_empty())) return open_within(entry, uri, settings);
    ReplayOptions options;
    options.buffers = buffers;
    options.speed = uri.take_number("speed", 1, 0.01, 100);
    options.loop = uri.take_integer("loop", settings.loop ? 1 : 0, 0, 1) == 1;
    std::unique_ptr<Source> opened = open_within(entry, uri, settings);
    if (!must_be_live && opened->info().fps <= 0) return opened;  // a photo has no rate
    opener = replay_opener(entry, std::move(uri), std::move(opened), options, settings.log);
  }
  if (!faults.is_empty()) opener = with_faults(std::move(opener), faults);
  return std::make_unique<LiveSource>(std::move(opener), name, settings, controls, calibration);
}

// The file of `uri`, with its options.
std::unique_ptr<Source> open_file_source(SourceUri uri, const SourceSettings& settings) {
  uri.scheme = scheme_of_file(uri.target);
  const Entry& entry = *find_entry(uri.scheme);
  return open_entry(entry, std::move(uri), settings);
}

// A file of that name goes before a scheme that there is not.
bool is_path(const std::string& text) {
  if (text.empty()) return false;
  return !has_scheme(text) || (find_entry(text.substr(0, text.find(':'))) == nullptr && file_exists(text));
}

std::unique_ptr<Source> open_path(const std::string& path, const SourceSettings& settings) {
  SourceUri uri;
  uri.text = uri.target = path;
  for (const char* cameras : {"/dev/video", "/dev/v4l/"}) {
    const Entry* entry = find_entry("v4l2");  // null on Android
    if (path.rfind(cameras, 0) != 0 || entry == nullptr) continue;
    uri.scheme = entry->scheme.name;
    return open_entry(*entry, std::move(uri), settings);
  }
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::u8path(path), error)) {
    throw Error(MAQ_ERROR_NOT_FOUND, path,
                " does not exist; check the path, or write scheme:target, as in stub:people or camera:.");
  }
  return open_file_source(std::move(uri), settings);
}

// With the options of `uri`.
std::unique_ptr<Source> open_first_camera(const SourceUri& uri, const SourceSettings& settings) {
  std::string problems;
  for (const CameraListing& camera : list_cameras()) {
    std::string problem = camera.problem;
    if (camera.status == MAQ_OK) {
      try {
        SourceUri same = uri;
        const SourceUri listed = parse_source_uri(camera.uri);
        same.scheme = listed.scheme;
        same.target = listed.target;
        return open_entry(*find_entry(listed.scheme), std::move(same), settings);
      } catch (const Error& error) {
        if (error.status() == MAQ_ERROR_OUT_OF_MEMORY) throw;
        problem = error.what();
      }
    }
    problems += " " + camera.uri + ": " + problem;
  }
  if (problems.empty()) throw Error(MAQ_ERROR_NOT_FOUND, "No camera was found; is one plugged in?");
  throw Error(MAQ_ERROR_NOT_FOUND, "No camera can be opened.", problems);
}

}  // namespace

const std::vector<SourceScheme>& source_schemes() {
  static const std::vector<SourceScheme> schemes = [] {
    std::vector<SourceScheme> list;
    for (const Entry& entry : kEntries) {
      list.push_back(entry.scheme);
      list.back().is_camera = entry.camera != nullptr || std::string(kCamera) == entry.scheme.name;
    }
    return list;
  }();
  return schemes;
}

std::vector<CameraListing> list_cameras() {
#ifdef __ANDROID__
  return list_android_cameras();
#elif defined(_WIN32)
  return {};
#else
  std::vector<CameraListing> all = list_v4l2_cameras(SystemCalls::real());
  for (CameraListing& camera : list_libcamera_cameras()) all.push_back(std::move(camera));
  for (CameraListing& camera : list_depthai_cameras()) all.push_back(std::move(camera));
  return all;
#endif
}

std::unique_ptr<Source> open_source(const std::string& text, const SourceSettings& settings) {
  if (is_path(text)) return open_path(text, settings);
  SourceUri uri = parse_source_uri(text);
  const Entry* entry = find_entry(uri.scheme);
  if (entry == nullptr) {
    std::string known;
    for (const Entry& other : kEntries) known += std::string(known.empty() ? "" : ", ") + other.scheme.name + ":";
    throw Error(MAQ_ERROR_UNSUPPORTED, "\"", uri.scheme, ":\" is not a kind of source of this build; there are ", known,
                ".");
  }
  if (entry->needs_target && uri.target.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "\"", text, "\" names nothing after ", uri.scheme, ":, as in ",
                entry->scheme.example, ".");
  }
  if (uri.scheme == kFile) return open_file_source(std::move(uri), settings);
  if (uri.scheme == kCamera) return open_first_camera(uri, settings);
  return open_entry(*entry, std::move(uri), settings);
}

}  // namespace maq
