package dev.maquette

import java.lang.ref.WeakReference
import java.util.concurrent.CountDownLatch
import java.util.concurrent.TimeUnit
import java.util.concurrent.atomic.AtomicInteger
import kotlin.concurrent.thread
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class HandleTest {
    private val released = AtomicInteger()

    private class Owner(released: AtomicInteger) {
        val handle = Handle(this, 7) { released.incrementAndGet() }
    }

    @Test
    fun itIsReleasedOnceHoweverOftenItIsClosed() {
        val owner = Owner(released)
        assertEquals(7L, owner.handle.use { it })
        repeat(3) { owner.handle.close() }
        assertEquals(1, released.get())
        val error = assertThrows(IllegalStateException::class.java) { owner.handle.use { } }
        assertEquals("This Owner is closed.", error.message)
    }

    @Test
    fun aCallThatRunsKeepsItAliveUntilItEnds() {
        val owner = Owner(released)
        val isIn = CountDownLatch(1)
        val mayEnd = CountDownLatch(1)
        val call = thread {
            owner.handle.use {
                isIn.countDown()
                mayEnd.await()
            }
        }
        isIn.await()
        owner.handle.close()
        assertEquals(0, released.get())
        assertThrows(IllegalStateException::class.java) { owner.handle.use { } }
        mayEnd.countDown()
        call.join()
        assertEquals(1, released.get())
    }

    @Test
    fun aCallThatFailsEndsItsUse() {
        val owner = Owner(released)
        assertThrows(ArithmeticException::class.java) { owner.handle.use { throw ArithmeticException() } }
        owner.handle.close()
        assertEquals(1, released.get())
    }

    @Test
    fun whatIsForgottenIsReleasedWithTheGarbage() {
        val isReleased = CountDownLatch(1)
        var owner: Any? = object { val handle = Handle(this, 7) { isReleased.countDown() } }
        val gone = WeakReference(owner)
        owner = null
        repeat(600) {
            System.gc()
            if (isReleased.await(100, TimeUnit.MILLISECONDS)) return
        }
        assertTrue("not released; garbage: ${gone.get() == null}", false)
    }

    @Test
    fun closingRacesWithCallsWithoutAUseAfterTheRelease() {
        repeat(200) {
            val isReleased = AtomicInteger()
            val late = AtomicInteger()
            val owner = Owner(isReleased)
            val callers = List(3) {
                thread {
                    try {
                        while (true) owner.handle.use { if (isReleased.get() > 0) late.incrementAndGet() }
                    } catch (_: IllegalStateException) {
                    }
                }
            }
            owner.handle.close()
            callers.forEach(Thread::join)
            assertEquals(1, isReleased.get())
            assertEquals(0, late.get())
        }
    }
}
