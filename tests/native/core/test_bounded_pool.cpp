// Pools of reused objects.
#include "core/bounded_pool.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "support/expect_error.h"

namespace {

using Pool = maq::BoundedPool<std::vector<int>>;

TEST(BoundedPool, ReturnedObjectsAreReusedAsTheyWereLeft) {
  Pool pool(2, "lists");
  auto first = pool.acquire();
  const auto* address = first.get();
  first->assign(3, 7);
  first.reset();
  auto again = pool.acquire();
  EXPECT_EQ(again.get(), address);
  EXPECT_EQ(*again, std::vector<int>(3, 7));
}

TEST(BoundedPool, MoreThanTheCapacityIsAnErrorThatNamesIt) {
  Pool pool(2, "lists");
  const auto first = pool.acquire();
  auto second = pool.acquire();
  expect_error(MAQ_ERROR_POOL_EMPTY, "All 2 lists", [&] { pool.acquire(); });
  second.reset();
  EXPECT_NE(pool.acquire(), nullptr);
}

TEST(BoundedPool, AnObjectOutlivesItsPoolAndReturnsFromAnyThread) {
  auto pool = std::make_unique<Pool>(1, "lists");
  auto held = pool->acquire();
  pool.reset();
  std::thread([owned = std::move(held)]() mutable { owned.reset(); }).join();
}

TEST(BoundedPool, ADeleterOfNoPoolDeletes) {
  std::unique_ptr<std::vector<int>, Pool::Deleter> alone(new std::vector<int>);
}

}  // namespace
