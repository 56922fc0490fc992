#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "arguments/bundle_argument.h"
#include "commands/commands.h"
#include "commands/installation.h"
#include "print.h"

namespace fs = std::filesystem;

namespace {

// Print a finding; a bad one has a remedy.
void well(const std::string& text) { print_output("  ok    %s\n", text.c_str()); }
void note(const std::string& text) { print_output("  note  %s\n", text.c_str()); }
void unwell(const std::string& text, const std::string& remedy) {
  print_output("  BAD   %s\n        -> %s\n", text.c_str(), remedy.c_str());
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

std::string first_line(const fs::path& path) {
  std::string line;
  std::getline(std::ifstream(path) >> std::ws, line);
  return line;
}

// "firefox (process 123)" for each program that has the file open; of other users' programs only root learns.
std::string users_of(const fs::path& device) {
  std::string users;
  std::error_code error;
  for (const fs::path& entry : entries_of("/proc")) {
    const std::string number = entry.filename().string();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    for (const fs::path& file : entries_of(entry / "fd")) {
      if (fs::read_symlink(file, error) != device) continue;
      users += (users.empty() ? "" : ", ") + first_line(entry / "comm") + " (process " + number + ")";
      break;
    }
  }
  return users;
}

bool has_group(gid_t group) {
  std::vector<gid_t> mine(256);
  const int count = getgroups(int(mine.size()), mine.data());
  return getegid() == group ||
         std::find(mine.begin(), mine.begin() + std::max(count, 0), group) != mine.begin() + std::max(count, 0);
}

// Why this user may not open the device.
void explain_permission(const fs::path& device) {
  struct stat found {};
  if (stat(device.c_str(), &found) != 0) return;
  const group* owner = getgrgid(found.st_gid);
  const std::string name = owner == nullptr ? std::to_string(found.st_gid) : owner->gr_name;
  if ((found.st_mode & S_IRGRP) == 0 || (found.st_mode & S_IWGRP) == 0) {
    unwell("only root may open it", "sudo chmod g+rw " + device.string() + ", or a udev rule with MODE=\"0660\"");
  } else if (!has_group(found.st_gid)) {
    unwell("it belongs to the group \"" + name + "\", in which you are not",
           "sudo usermod -aG " + name + " $USER, then log in again (or: newgrp " + name + ")");
  }
}

// A listed camera; true when it can be used.
bool look_at(const maq_camera_list* list, uint32_t index) {
  maq_camera_info info{};
  info.struct_size = sizeof info;
  maquette::check(maq_camera_list_get_camera(list, index, &info));
  const std::string uri = info.uri;
  const std::string place = uri.substr(uri.find(':') + 1);
  print_output("\n%s  %s\n", info.uri, info.name);
  if (info.status != MAQ_OK) {
    unwell(info.problem, "see below, and `maquette sources` when it is done");
    if (info.status == MAQ_ERROR_NO_PERMISSION) explain_permission(place);
    return false;
  }
  uint32_t usable = 0;
  for (uint32_t k = 0; k < info.mode_count; ++k) {
    maq_camera_mode mode{};
    mode.struct_size = sizeof mode;
    maquette::check(maq_camera_list_get_mode(list, index, k, &mode));
    usable += mode.is_usable == 1 ? 1 : 0;
  }
  well("may be opened");
  if (usable == 0) {
    unwell("none of its " + std::to_string(info.mode_count) + " formats is supported",
           "`maquette sources` lists them; look for a setting of the camera that gives YUYV, NV12 or MJPEG");
  } else {
    well(std::to_string(usable) + " sizes and formats can be used");
  }
  const std::string users = users_of(place);
  if (!users.empty()) note("open in " + users + ": only one program can stream at a time");
  return usable > 0;
}

// Cameras that the kernel knows and that have no file, or that no driver has taken.
void look_for_the_missing() {
  std::error_code error;
  for (const fs::path& known : entries_of("/sys/class/video4linux")) {
    const fs::path device = fs::path("/dev") / known.filename();
    if (fs::exists(device, error)) continue;
    unwell(first_line(known / "name") + " has no file " + device.string(),
           "in a container: start it with --device=" + device.string() + "; else is udev running?");
  }
  for (const fs::path& interface : entries_of("/sys/bus/usb/devices")) {
    constexpr const char* kVideoClass = "0e";
    if (first_line(interface / "bInterfaceClass") != kVideoClass || fs::exists(interface / "driver", error)) continue;
    unwell("the USB camera at " + interface.filename().string() + " has no driver", "sudo modprobe uvcvideo");
  }
  if (!fs::exists("/run/udev/data", error)) {
    note("udev is not running: cameras work, but libcamera finds none without it");
  }
}

// Parts of the SDK that bring libraries of others, and so may be missing.
void look_at_parts(const maquette::Context& context) {
  for (const char* uri : {"libcamera:none", "depthai:none"}) {
    const std::string scheme = std::string(uri).substr(0, std::string(uri).find(':') + 1);
    maq_source* source = nullptr;
    const maq_status status = maq_source_create(context.get(), uri, nullptr, &source);
    maq_source_destroy(source);
    if (status == MAQ_ERROR_RUNTIME_LIBRARY || status == MAQ_ERROR_UNSUPPORTED) {
      note(scheme + " cannot be used by this build; `maquette play " + uri + "` says why");
    } else {
      well(scheme + " can be used by this build");
    }
  }
}

// True unless ONNX Runtime, which runs all networks, is not there.
bool look_at_onnxruntime(const maquette::Context& context) {
  try {
    well("ONNX Runtime " + context.onnxruntime_version() + "  " + context.onnxruntime_path());
    return true;
  } catch (const maquette::Error& error) {
    unwell("no network can run", error.what());
    return false;
  }
}

// Returns false if networks are damaged. Missing networks are no error: users install only the systems they need.
bool look_at_networks(const maquette::Context& context) {
  print_output("\nNetworks\n");
  if (!look_at_onnxruntime(context)) return false;
  bool are_whole = true;
  for (const SystemNetworks& networks : networks_of_build()) {
    const InstalledNetworks found = find_networks(context, networks);
    const std::string system = networks.system;
    if (found.path.empty()) {
      note(missing_networks(networks));
      print_output("        -> %s\n", advice_on_missing(networks).c_str());
    } else if (!found.problem.empty()) {
      unwell(system + ": " + found.problem, "install the networks again, or see " + std::string(networks.variable));
      are_whole = false;
    } else {
      char size[32];
      std::snprintf(size, sizeof size, "%.1f MB", double(found.bytes) / 1e6);
      well(system + ": " + found.precision + ", " + size + "  " + found.path);
    }
  }
  return are_whole;
}

void look_at_ffmpeg() {
  print_output("\nClips\n");
  const InstalledFfmpeg found = find_ffmpeg();
  if (found.problem.empty()) {
    well("ffmpeg " + found.version + " reads them  " + found.path);
  } else {
    note("clips cannot be read: " + found.problem);
    print_output(
        "        -> install it (Debian: apt install ffmpeg; Python: pip install 'maquette[clips]'), or set MAQ_FFMPEG "
        "to its path\n");
  }
}

int look_at_cameras(const maquette::Context& context) {
  maq_camera_list* made = nullptr;
  maquette::check(maq_camera_list_create(context.get(), &made));
  const maquette::Owner<maq_camera_list, maq_camera_list_destroy> list(made);
  const uint32_t count = maq_camera_list_get_count(list.get());
  uint32_t usable = 0;
  for (uint32_t i = 0; i < count; ++i) usable += look_at(list.get(), i) ? 1 : 0;
  print_output("\nThis machine\n");
  look_for_the_missing();
  look_at_parts(context);
  if (count == 0) {
    unwell("no camera is plugged in", "plug one in; without one try: maquette play stub:people, or play a recording");
  }
  print_output("\n%u of %u cameras can be used.\n", usable, count);
  return usable > 0 ? 0 : 1;
}

int look_at_all() {
  print_output("maquette %s (%s)\n", maq_get_sdk_version(), maq_get_build_options());
  const maquette::Context context;
  const bool networks_are_whole = look_at_networks(context);
  look_at_ffmpeg();
  const int of_cameras = look_at_cameras(context);
  return networks_are_whole ? of_cameras : 1;
}

}  // namespace

void add_doctor_command(CLI::App& app, int* exit_code) {
  CLI::App* command =
      app.add_subcommand("doctor", "Find out why a network, a clip or a camera does not work, with the remedy");
  command->footer("Exit status: 0 if the installed networks and at least one camera can be used, else 1.");
  command->callback([=] { *exit_code = look_at_all(); });
}
