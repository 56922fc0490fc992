package dev.maquette

import java.io.File
import java.util.concurrent.atomic.AtomicBoolean
import kotlin.concurrent.thread
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.runner.RunWith
import org.robolectric.RobolectricTestRunner
import org.robolectric.annotation.Config
import org.robolectric.annotation.GraphicsMode

/** A test of classes that need Android's own. All have one configuration: a native library has one class loader. */
@RunWith(RobolectricTestRunner::class)
@Config(sdk = [34], manifest = Config.NONE)
@GraphicsMode(GraphicsMode.Mode.NATIVE)
abstract class AndroidTest {
    /** The message of the exception that [work] must throw. */
    protected fun failure(status: Status, work: () -> Unit): String {
        val error = assertThrows(MaquetteException::class.java) { work() }
        assertEquals(error.message, status, error.status)
        return error.message!!
    }

    protected fun assertClosed(work: () -> Unit) {
        assertThrows(IllegalStateException::class.java) { work() }
    }

    /** Returns the memory of this process. */
    protected fun residentMiB(): Long {
        val line = File("/proc/self/status").readLines().first { it.startsWith("VmRSS") }
        return line.filter(Char::isDigit).toLong() / 1024
    }

    /** How many threads of the library the process has: of pipelines, cameras and networks. */
    protected fun threadCount(): Int =
        File("/proc/self/task").listFiles()!!.count { task ->
            val name = runCatching { File(task, "comm").readText() } // fails when the thread ends meanwhile
            name.getOrNull()?.startsWith("maq ") == true
        }

    /** Runs [work], which must not wait for what comes much later, if ever. */
    protected fun soon(work: () -> Unit) {
        val begin = System.nanoTime()
        work()
        val ms = (System.nanoTime() - begin) / 1_000_000
        assertTrue("$ms ms", ms < SOON_MS)
    }

    /** Waits until [condition] holds, and runs [meanwhile] again and again. */
    protected fun until(what: String, meanwhile: () -> Unit = {}, condition: () -> Boolean) {
        val end = System.nanoTime() + SOON_MS * 1_000_000
        while (!condition()) {
            assertTrue(what, System.nanoTime() < end)
            meanwhile()
            Thread.sleep(5)
        }
    }

    /** Does [step] while another thread collects garbage, until it returns true. */
    protected fun whileGarbageIsCollected(what: String, step: () -> Boolean) {
        val isDone = AtomicBoolean()
        val collector = thread { while (!isDone.get()) System.gc().also { Thread.sleep(5) } }
        try {
            until(what, condition = step)
        } finally {
            isDone.set(true)
            collector.join()
        }
    }

    companion object {
        /** Longer than a busy machine takes, shorter than what must not be waited for. */
        const val SOON_MS = 90_000L
    }
}
