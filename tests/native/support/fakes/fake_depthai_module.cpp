// libmaquette_depthai.so with a device in memory, which sends a hundred images with depth a second.
#include <chrono>
#include <thread>

#include "core/module.h"
#include "support/fakes/fake_depthai.h"

namespace {

class SendingDepthAi : public FakeDepthAi {
 public:
  ~SendingDepthAi() override {
    done_ = true;
    sender_.join();
  }

  std::unique_ptr<maq::DepthAiSession> open(const std::string& device) override {
    if (device == "10.0.0.1") throw std::runtime_error("Insufficient permissions to communicate with the device");
    return FakeDepthAi::open(device);
  }

 private:
  void send() {
    for (int i = 0; !done_; ++i) {
      const int64_t time = now_ns();
      send_colour(colour(200, i, time));
      send_depth(depth(1500, i, time));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  std::atomic<bool> done_{false};
  std::thread sender_{[this] { send(); }};
};

}  // namespace

extern "C" __attribute__((visibility("default"))) maq::ModuleExport maquette_depthai() {
  static SendingDepthAi device;
  return {MAQ_MODULE_VERSION, static_cast<maq::DepthAiDriver*>(&device)};
}
