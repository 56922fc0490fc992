#include "sources/libcamera/manager.h"

#include <libcamera/logging.h>
#include <libcamera/property_ids.h>
#include <libcamera/version.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/error.h"
#include "core/memory.h"
#include "core/thread.h"
#include "sources/camera_errors.h"

// Private in libcamera's header, but a symbol of its library: making a second manager in a process aborts it.
extern libcamera::CameraManager* running_manager __asm__("_ZN9libcamera13CameraManager5self_E") __attribute__((weak));

namespace maq {
namespace {

constexpr int kMaxDevices = 64;
constexpr std::chrono::seconds kLockTimeout(5);
constexpr std::chrono::seconds kExitTimeout(2);

struct Library {
  std::timed_mutex mutex;
  std::unique_ptr<libcamera::CameraManager> manager;
  int users = 0;
};

// Never destroyed: threads that close cameras may outlive the program's static objects.
Library& library() {
  static Library* const one = new Library;
  return *one;
}

// The thread of the source that was destroyed last may still be closing its camera when the program ends. libcamera's
// own static objects, which are destroyed after this one, must not go away under it; so the mutex is taken for good.
struct ExitGuard {
  ~ExitGuard() { [[maybe_unused]] const bool kept = library().mutex.try_lock_for(kExitTimeout); }
} exit_guard;

// libcamera waits without end for a thread of its own that does not start, and ends the process without a descriptor or
// memory. These resources are checked before it starts.
void require_means_to_start() {
  constexpr size_t kBytes = size_t(96) << 20;
  constexpr size_t kThreads = 4;
  constexpr size_t kDescriptors = 8;
  require_memory(kBytes);
  require_threads(kThreads);
  std::vector<int> descriptors;
  while (descriptors.size() < kDescriptors && (descriptors.empty() || descriptors.back() >= 0)) {
    descriptors.push_back(eventfd(0, EFD_CLOEXEC));
  }
  const int error = descriptors.back() < 0 ? errno : 0;
  for (const int descriptor : descriptors) {
    if (descriptor >= 0) close(descriptor);
  }
  if (error == 0) return;
  throw Error(MAQ_ERROR_UNSUPPORTED, "libcamera does not start: ", std::strerror(error),
              ". Close files, or raise the limit of them (ulimit -n).");
}

std::unique_ptr<libcamera::CameraManager> start_manager() {
  if (&running_manager != nullptr && running_manager != nullptr) {
    throw Error(MAQ_ERROR_BUSY,
                "This program runs a CameraManager of its own, and libcamera allows one in a process: stop it first.");
  }
  if (std::getenv("LIBCAMERA_LOG_LEVELS") == nullptr && std::getenv("LIBCAMERA_LOG_FILE") == nullptr) {
    libcamera::logSetTarget(libcamera::LoggingTargetNone);
  }
  require_means_to_start();
  auto manager = std::make_unique<libcamera::CameraManager>();
  const int error = manager->start();
  if (error != 0) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "libcamera does not start: ", std::strerror(std::abs(error)),
                ". LIBCAMERA_LOG_LEVELS=*:DEBUG in the environment shows why.");
  }
  return manager;
}

// libcamera leaves out the devices that it may not open.
bool may_open_media_devices() {
  for (int number = 0; number < kMaxDevices; ++number) {
    const std::string path = "/dev/media" + std::to_string(number);
    if (access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES) return false;
  }
  return true;
}

}  // namespace

std::unique_lock<std::timed_mutex> lock_libcamera() {
  std::unique_lock<std::timed_mutex> lock(library().mutex, kLockTimeout);
  if (!lock) {
    throw Error(MAQ_ERROR_BUSY, "libcamera has been opening or closing another camera for ", kLockTimeout.count(),
                " s; does that one hang?");
  }
  return lock;
}

std::unique_lock<std::timed_mutex> lock_libcamera_to_close() {
  return std::unique_lock<std::timed_mutex>(library().mutex);
}

LibcameraManagerUse::LibcameraManagerUse() {
  if (library().users == 0) library().manager = start_manager();
  ++library().users;
}

LibcameraManagerUse::~LibcameraManagerUse() {
  if (--library().users == 0) library().manager.reset();
}

libcamera::CameraManager& LibcameraManagerUse::operator*() const { return *library().manager; }

std::shared_ptr<libcamera::Camera> find_libcamera_camera(libcamera::CameraManager& manager, const std::string& name) {
  const std::vector<std::shared_ptr<libcamera::Camera>> cameras = manager.cameras();
  const bool is_number = name.find_first_not_of("0123456789") == std::string::npos && name.size() < 9;
  if (is_number && std::stoul(name) < cameras.size()) return cameras[std::stoul(name)];
  for (const std::shared_ptr<libcamera::Camera>& camera : cameras) {
    if (camera->id() == name) return camera;
  }
  if (!may_open_media_devices()) fail_camera("libcamera:" + name, "is not there, or may not be opened", EACCES);
  throw Error(MAQ_ERROR_NOT_FOUND, "libcamera:", name, " is not there: libcamera sees ",
              cameras.empty() ? "no camera" : concatenate(cameras.size(), cameras.size() == 1 ? " camera" : " cameras"),
              ". Is it plugged in, and is this its id? `maquette sources` lists them.");
}

std::vector<std::string> device_entries([[maybe_unused]] libcamera::CameraManager& manager,
                                        const libcamera::Camera& camera) {
  std::vector<dev_t> numbers;
#if LIBCAMERA_VERSION_MAJOR == 0 && LIBCAMERA_VERSION_MINOR == 0
  for (int number = 0; number < kMaxDevices; ++number) {
    const std::string path = "/dev/video" + std::to_string(number);
    struct stat found {};
    if (stat(path.c_str(), &found) == 0 && manager.get(found.st_rdev).get() == &camera) {
      numbers.push_back(found.st_rdev);
    }
  }
#else
  if (const auto found = camera.properties().get(libcamera::properties::SystemDevices)) {
    for (const int64_t number : *found) numbers.push_back(dev_t(number));
  }
#endif
  std::vector<std::string> entries;
  for (const dev_t number : numbers) {
    std::string entry = concatenate("/sys/dev/char/", major(number), ":", minor(number));
    if (access(entry.c_str(), F_OK) == 0) entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace maq
