#include "core/error.h"
#include "image/clips/clip_reader.h"

namespace maq {

ClipReader::ClipReader(const std::string& path, double) {
  throw Error(MAQ_ERROR_UNSUPPORTED, path,
              " is a clip, and the build for Windows reads none. Make images of its frames, or read it with a build "
              "for Linux and record it (maquette record): recordings can be read.");
}

bool ClipReader::read(ImageView&, int64_t&) { return false; }

ClipReader::Process::~Process() = default;

}  // namespace maq
