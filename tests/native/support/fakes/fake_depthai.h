// A DepthAI device in memory: a test delivers frames, makes any call fail or hang, and unplugs it.
#pragma once

#include <atomic>
#include <ctime>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/error.h"
#include "sources/depthai/depthai_session.h"

class FakeDepthAi : public maq::DepthAiDriver {
 public:
  enum class Call { kList, kOpen, kFeatures, kLens, kStart, kProblem, kClose, kControl };
  enum class Fault { kNone, kRuntimeError, kError, kInt };

  // Set before a camera is opened.
  std::vector<maq::DepthAiDevice> devices{{"18443010A1", "1.2", "RVC2", MAQ_OK, ""}};
  maq::DepthAiFeatures features{"", 1920, 1080, 60, true, true};  // without an id: that of the device
  std::optional<maq::DepthAiLens> lens{{500, 510, 320, 240, {}, true}};
  std::string fault_text = "a fault of the library";

  std::vector<maq::DepthAiDevice> list() override {
    enter(Call::kList);
    std::lock_guard<std::mutex> lock(mutex_);
    return plugged_ ? devices : std::vector<maq::DepthAiDevice>();
  }
  std::unique_ptr<maq::DepthAiSession> open(const std::string& device) override {
    enter(Call::kOpen);
    std::lock_guard<std::mutex> lock(mutex_);
    if (!plugged_) throw std::runtime_error("Failed to find device (" + device + ")");
    ++opened_;
    ++sessions_;
    opened_device_ = device;
    return std::make_unique<Session>(*this, device);
  }

  void break_call(Call call, Fault fault) {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_[call] = fault;
  }
  void mend() {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_.clear();
  }
  void unplug() {
    std::lock_guard<std::mutex> lock(mutex_);
    plugged_ = false;
    receiver_.reset();
  }
  void plug() {
    std::lock_guard<std::mutex> lock(mutex_);
    plugged_ = true;
  }
  // While it is held, that call hangs.
  std::mutex& hang(Call call) { return hangs_[size_t(call)]; }
  // Whether a thread is in that call and has not been let go on.
  bool is_waiting(Call call) const { return waiting_[size_t(call)] > 0; }

  static int64_t now_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return int64_t(now.tv_sec) * 1000000000 + now.tv_nsec;
  }

  // Frames as agreed, whose bytes all are `value` (of depth: whose pixels all are `value` millimetres).
  maq::DepthAiFrame colour(uint8_t value, int64_t sequence, int64_t timestamp_ns = now_ns()) {
    const size_t stride = size_t(plan().width_px) + 32, rows = size_t(plan().height_px);
    maq::DepthAiFrame frame = filled(std::vector<uint8_t>(stride * (rows + rows / 2), value), stride);
    frame.format = MAQ_PIXEL_NV12;
    frame.uv_offset_bytes = stride * rows;
    frame.sequence = sequence;
    frame.timestamp_ns = timestamp_ns;
    return frame;
  }
  maq::DepthAiFrame depth(uint16_t value, int64_t sequence, int64_t timestamp_ns = now_ns()) {
    const size_t stride = size_t(plan().width_px) * 2 + 64, rows = size_t(plan().height_px);
    std::vector<uint8_t> bytes(stride * rows);
    for (size_t i = 0; i < bytes.size(); i += 2) {
      bytes[i] = uint8_t(value & 255);
      bytes[i + 1] = uint8_t(value >> 8);
    }
    maq::DepthAiFrame frame = filled(std::move(bytes), stride);
    frame.format = MAQ_PIXEL_DEPTH16;
    frame.sequence = sequence;
    frame.timestamp_ns = timestamp_ns;
    return frame;
  }
  // False without a receiver.
  bool send_colour(maq::DepthAiFrame frame) {
    const auto to = receiver();
    if (to != nullptr) to->receive_colour(std::move(frame));
    return to != nullptr;
  }
  bool send_depth(maq::DepthAiFrame frame) {
    const auto to = receiver();
    if (to != nullptr) to->receive_depth(std::move(frame));
    return to != nullptr;
  }

  maq::DepthAiPlan plan() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return plan_;
  }
  std::vector<std::string> commands() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return commands_;
  }
  std::string opened_device() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return opened_device_;
  }
  // Under the lock, so that a test that sees a session closed may destroy this.
  int opened() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return opened_;
  }
  int sessions() const {  // that are not closed
    std::lock_guard<std::mutex> lock(mutex_);
    return sessions_;
  }
  int frames_alive() const { return *alive_; }  // not yet freed
  // Null without one.
  std::shared_ptr<maq::DepthAiReceiver> receiver() {
    std::lock_guard<std::mutex> lock(mutex_);
    return receiver_;
  }

 private:
  class Session : public maq::DepthAiSession {
   public:
    Session(FakeDepthAi& fake, std::string device) : fake_(fake), device_(std::move(device)) {}
    ~Session() override { shut(); }

    maq::DepthAiFeatures features() override {
      fake_.enter(Call::kFeatures);
      maq::DepthAiFeatures found = fake_.features;
      if (found.id.empty()) found.id = device_;
      return found;
    }
    std::optional<maq::DepthAiLens> lens(int, int) override {
      fake_.enter(Call::kLens);
      return fake_.lens;
    }
    void start(const maq::DepthAiPlan& plan, std::shared_ptr<maq::DepthAiReceiver> receiver) override {
      fake_.enter(Call::kStart);
      std::lock_guard<std::mutex> lock(fake_.mutex_);
      fake_.plan_ = plan;
      fake_.receiver_ = std::move(receiver);
    }
    std::string problem() override {
      fake_.enter(Call::kProblem);
      std::lock_guard<std::mutex> lock(fake_.mutex_);
      return fake_.plugged_ ? "" : "X_LINK_ERROR";
    }
    void close() override {
      fake_.enter(Call::kClose);
      shut();
    }

    void set_auto_exposure(bool on) override { note("auto_exposure", on); }
    void set_exposure(int exposure_us, int gain_iso) override { note("exposure", exposure_us, gain_iso); }
    void set_auto_focus(bool on) override { note("auto_focus", on); }
    void set_focus(int position) override { note("focus", position); }
    void set_auto_white_balance(bool on) override { note("auto_white_balance", on); }
    void set_white_balance(int kelvin) override { note("white_balance", kelvin); }
    void set_brightness(int value) override { note("brightness", value); }

   private:
    template <class... Values>
    void note(const char* command, Values... values) {
      fake_.enter(Call::kControl);
      std::lock_guard<std::mutex> lock(fake_.mutex_);
      fake_.commands_.push_back(command + (... + (" " + std::to_string(values))));
    }
    void shut() {
      std::lock_guard<std::mutex> lock(fake_.mutex_);
      if (is_shut_) return;
      is_shut_ = true;
      fake_.receiver_.reset();
      --fake_.sessions_;
    }

    FakeDepthAi& fake_;
    const std::string device_;
    bool is_shut_ = false;
  };

  void enter(Call call) {
    ++waiting_[size_t(call)];
    const std::lock_guard<std::mutex> hang(hangs_[size_t(call)]);
    --waiting_[size_t(call)];
    Fault fault = Fault::kNone;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (const auto found = faults_.find(call); found != faults_.end()) fault = found->second;
    }
    switch (fault) {
      case Fault::kNone: return;
      case Fault::kRuntimeError: throw std::runtime_error(fault_text);
      case Fault::kError: throw maq::Error(MAQ_ERROR_BUSY, fault_text);
      case Fault::kInt: throw 5;
    }
  }

  maq::DepthAiFrame filled(std::vector<uint8_t> bytes, size_t stride_bytes) {
    ++*alive_;
    const std::shared_ptr<const std::vector<uint8_t>> owner(new std::vector<uint8_t>(std::move(bytes)),
                                                            [alive = alive_](const std::vector<uint8_t>* old) {
                                                              delete old;
                                                              --*alive;
                                                            });
    maq::DepthAiFrame frame;
    frame.data = owner->data();
    frame.size_bytes = owner->size();
    frame.owner = owner;
    frame.width_px = plan().width_px;
    frame.height_px = plan().height_px;
    frame.stride_bytes = stride_bytes;
    return frame;
  }

  mutable std::mutex mutex_;
  std::mutex hangs_[8];
  std::atomic<int> waiting_[8] = {};
  std::map<Call, Fault> faults_;
  bool plugged_ = true;
  maq::DepthAiPlan plan_;
  std::shared_ptr<maq::DepthAiReceiver> receiver_;
  std::vector<std::string> commands_;
  std::string opened_device_;
  int opened_ = 0, sessions_ = 0;
  std::shared_ptr<std::atomic<int>> alive_ = std::make_shared<std::atomic<int>>(0);
};
