#include "nn/onnxruntime_library.h"

#include <onnxruntime_c_api.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <new>
#include <streambuf>
#include <string_view>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/memory.h"
#include "core/module.h"
#include "nn/telemetry.h"

namespace maq {
namespace {

// The oldest interface with all functions that the SDK calls, and tested with it; later releases keep it.
constexpr uint32_t kApiVersion = 20;
// Functions that are called if the library has them (provider.cpp).
constexpr uint32_t kNewerApiVersion = 24;
static_assert(kNewerApiVersion <= ORT_API_VERSION, "the headers are of an older ONNX Runtime");
constexpr char kFileName[] = MAQ_ONNXRUNTIME_FILE;
constexpr char kRemedy[] =
    " Set MAQ_ONNXRUNTIME_LIB to the file, or put " MAQ_ONNXRUNTIME_FILE " in the folder of " MAQ_LIBRARY_FILE ".";

// The named file, which must open, or otherwise the first of the usual files that opens.
void* find_library(const std::string& explicit_path, std::string* opened_path) {
  const char* from_environment = std::getenv("MAQ_ONNXRUNTIME_LIB");
  std::string named = explicit_path;
  if (named.empty() && from_environment != nullptr) named = from_environment;
  if (!named.empty()) {
    const auto [library, error] = open_library(named);
    if (library == nullptr) {
      throw Error(MAQ_ERROR_RUNTIME_LIBRARY, "ONNX Runtime cannot be opened: ", error, ".",
                  explicit_path.empty() ? " The file was named by MAQ_ONNXRUNTIME_LIB; correct or unset it."
                                        : " The file was named by onnxruntime_library of the context's config.");
    }
    *opened_path = named;
    return library;
  }
  const std::string folder = library_folder();
  for (const std::string& path :
       {module_path(kFileName), folder + kFileName, std::string(kFileName), std::string(MAQ_ONNXRUNTIME_SONAME)}) {
    if (void* library = open_library(path).library) {
      *opened_path = path;
      return library;
    }
  }
  throw Error(MAQ_ERROR_RUNTIME_LIBRARY, "ONNX Runtime (", kFileName, ") was not found in ", folder, "maquette, in ",
              folder, " or on the system's search path.", kRemedy);
}

// The memory for the schemas of operators; without it, ONNX prints.
constexpr size_t kEnvironmentBytes = size_t(24) << 20;

// Keeps what a thread writes to std::cerr, for which it takes no memory; other threads write on. ONNX prints the
// failures of its schemas there.
class CapturedErrors : public std::streambuf {
 public:
  // Runs `call` and returns the beginning of its text. Not for two threads at once.
  template <class Call>
  static std::string_view of(Call&& call) {
    static auto* const captured = new CapturedErrors;  // stays: another thread may be writing through it
    captured->thread_ = std::this_thread::get_id();
    captured->size_ = 0;
    captured->before_ = std::cerr.rdbuf(captured);
    call();
    std::cerr.rdbuf(captured->before_);
    return {captured->text_.data(), captured->size_};
  }

 protected:
  int_type overflow(int_type character) override {
    const char one = traits_type::to_char_type(character);
    return xsputn(&one, 1) == 1 ? character : traits_type::eof();
  }
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    if (std::this_thread::get_id() != thread_) return before_ == nullptr ? 0 : before_->sputn(text, count);
    const size_t kept = std::min(size_t(count), text_.size() - size_);
    std::copy_n(text, kept, text_.begin() + ptrdiff_t(size_));
    size_ += kept;
    return count;
  }

 private:
  std::thread::id thread_;
  std::streambuf* before_ = nullptr;
  std::array<char, 500> text_{};
  size_t size_ = 0;
};

// ONNX Runtime has one environment for a process, whose logger is the one of the first caller and may be gone by the
// time it is called; sessions have loggers of their own (session.cpp), so this one only keeps it from printing.
void ORT_API_CALL discard_log(void*, OrtLoggingLevel, const char*, const char*, const char*, const char*) {}

}  // namespace

std::string without_source_place(const char* given) {
  std::string text = given;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  const size_t place = text.find("/onnxruntime_src/");
  const size_t open = place == std::string::npos ? place : text.find('(', place);
  if (open == std::string::npos) return text;
  size_t close = open;
  for (int depth = 0; close < text.size(); ++close) {
    depth += (text[close] == '(') - (text[close] == ')');
    if (depth == 0) break;
  }
  return close + 2 >= text.size() ? text : text.substr(0, place) + text.substr(close + 2);
}

OnnxRuntimeLibrary::OnnxRuntimeLibrary(const std::string& explicit_path, const Log& log) : log_(log) {
  keep_telemetry_off();

  // Not closed again once it started: its threads and thread-local storage do not survive unloading.
  library_ = find_library(explicit_path, &path_);
  const auto get_api_base = reinterpret_cast<const OrtApiBase* (*)()>(symbol("OrtGetApiBase"));
  if (get_api_base == nullptr) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, path_, " is not ONNX Runtime: it has no OrtGetApiBase.", kRemedy);
  }
  require_memory(kThreadLocalBytes);
  const OrtApiBase* base = get_api_base();
  version_ = base->GetVersionString();
  minor_version_ = std::atoi(version_.c_str() + version_.find('.') + 1);
  api_ = base->GetApi(minor_version_ < int(kNewerApiVersion) ? kApiVersion : kNewerApiVersion);
  if (api_ == nullptr) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, path_, " is ONNX Runtime ", version_, ", but 1.", kApiVersion,
                ".0 or newer is needed.", kRemedy);
  }
  start();
  log_.write(MAQ_LOG_INFO, "ONNX Runtime ", version_, " opened from ", path_);
}

void OnnxRuntimeLibrary::start() {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  try {
    require_memory(kEnvironmentBytes);
    OrtStatus* status = nullptr;
    const std::string_view printed = CapturedErrors::of([&] {
      status = api_->CreateEnvWithCustomLogger(discard_log, nullptr, ORT_LOGGING_LEVEL_WARNING, "maquette", &env_);
    });
    if (!printed.empty()) log_.write(MAQ_LOG_WARNING, "ONNX Runtime printed while it started: ", printed);
    check(status, MAQ_ERROR_RUNTIME_LIBRARY, "ONNX Runtime does not start");
    end_telemetry(*api_, env_);
    if (says_out_of_memory(printed)) throw std::bad_alloc();  // it has not all of its operators
  } catch (...) {
    // Half started, it would fail at each later start. It has no threads yet, so that it can be closed and opened anew.
    if (env_ != nullptr) api_->ReleaseEnv(env_);
    close_library(library_);
    throw;
  }
}

OnnxRuntimeLibrary::~OnnxRuntimeLibrary() {
  if (env_ != nullptr) api_->ReleaseEnv(env_);
}

void* OnnxRuntimeLibrary::symbol(const char* name) const { return find_symbol(library_, name); }

void OnnxRuntimeLibrary::check(OrtStatus* result, maq_status status, const std::string& what) const {
  if (result == nullptr) return;
  const std::string text = without_source_place(api_->GetErrorMessage(result));
  api_->ReleaseStatus(result);
  if (says_out_of_memory(text)) {
    throw Error(MAQ_ERROR_OUT_OF_MEMORY, what, ": there is not enough memory. Free memory, or raise the limit of it.");
  }
  throw Error(status, what, ": ", text);
}

}  // namespace maq
