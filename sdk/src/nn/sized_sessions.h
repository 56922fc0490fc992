// Sessions of one network for images of several sizes. A graph that leaves height and width open runs faster where a
// session is told them, so each size has a session of its own, and the last few are kept.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "nn/session.h"

namespace maq {

class SizedSessions {
 public:
  // `bytes` and what is behind `runtime` as of Session; `bytes` must outlive this. Nothing is opened yet.
  SizedSessions(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const std::vector<uint8_t>& bytes, GraphSpec spec,
                std::string name, SessionSettings settings, size_t max_kept);

  // The session for an image of that size: the sizes that the graph's inputs call "height", "width", "height/2" and so
  // on are fixed. Stays until `max_kept` others were asked for. Throws the errors of Session.
  Session& at(int width_px, int height_px);

 private:
  struct Kept {
    int width_px, height_px;
    std::unique_ptr<Session> session;
  };

  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  const std::vector<uint8_t>& bytes_;
  GraphSpec spec_;
  std::string name_;
  SessionSettings settings_;
  size_t max_kept_;
  std::list<Kept> kept_;  // the one that was used last is first
};

}  // namespace maq
