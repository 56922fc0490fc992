// Descriptors and events that close themselves.
#include "core/files/unique_fd.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <thread>
#include <utility>

namespace {

using maq::EventFd;
using maq::UniqueFd;

UniqueFd open_null() { return UniqueFd(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }
bool is_open_file(int fd) { return ::fcntl(fd, F_GETFD) >= 0; }
bool is_readable(const EventFd& event) {
  pollfd polled{event.get(), POLLIN, 0};
  return ::poll(&polled, 1, 0) == 1;
}

TEST(UniqueFd, ClosesOnceWhatItOwns) {
  int fd = -1;
  {
    const UniqueFd file = open_null();
    fd = file.get();
    ASSERT_TRUE(file.is_open());
    EXPECT_TRUE(is_open_file(fd));
  }
  EXPECT_FALSE(is_open_file(fd));
  EXPECT_FALSE(UniqueFd().is_open());
}

TEST(UniqueFd, MovingLeavesNothingBehind) {
  UniqueFd first = open_null(), second = open_null();
  const int kept = first.get(), closed = second.get();
  second = std::move(first);
  EXPECT_EQ(second.get(), kept);
  EXPECT_FALSE(is_open_file(closed));
  const UniqueFd third(std::move(second));
  EXPECT_EQ(third.get(), kept);
  EXPECT_TRUE(is_open_file(kept));
}

TEST(UniqueFd, ResetClosesAndTakesAnother) {
  UniqueFd file = open_null();
  const int before = file.get();
  const int other = ::fcntl(before, F_DUPFD_CLOEXEC, 0);
  file.reset(other);
  EXPECT_FALSE(is_open_file(before));
  EXPECT_EQ(file.get(), other);
  file.reset();
  EXPECT_FALSE(file.is_open());
  EXPECT_FALSE(is_open_file(other));
}

TEST(UniqueFd, AnEventFlagIsTakenOnceHoweverOftenItWasSignalled) {
  EventFd event;
  EXPECT_FALSE(event.take());
  event.signal();
  event.signal();
  EXPECT_TRUE(is_readable(event));
  EXPECT_TRUE(event.take());
  EXPECT_FALSE(is_readable(event));
  EXPECT_FALSE(event.take());
}

TEST(UniqueFd, ACountingEventIsTakenAsOftenAsItWasSignalled) {
  EventFd event(EventFd::Kind::kCounting);
  event.signal();
  event.signal();
  EXPECT_TRUE(event.take());
  EXPECT_TRUE(is_readable(event));
  EXPECT_TRUE(event.take());
  EXPECT_FALSE(event.take());
}

TEST(UniqueFd, AnEventWakesAThreadThatPolls) {
  EventFd event;
  std::thread signals([&] { event.signal(); });
  pollfd polled{event.get(), POLLIN, 0};
  EXPECT_EQ(::poll(&polled, 1, 60000), 1);
  signals.join();
}

}  // namespace
