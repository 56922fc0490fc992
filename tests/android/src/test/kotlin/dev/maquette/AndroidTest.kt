package dev.maquette

import java.io.File
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
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

    /** What the process has in memory. */
    protected fun residentMiB(): Long {
        val line = File("/proc/self/status").readLines().first { it.startsWith("VmRSS") }
        return line.filter(Char::isDigit).toLong() / 1024
    }

    /** How many threads the process has. */
    protected fun threadCount(): Int = File("/proc/self/task").list()!!.size

    /** Runs [work], which must take less than [limitMs]. */
    protected fun within(limitMs: Long, work: () -> Unit) {
        val begin = System.nanoTime()
        work()
        val ms = (System.nanoTime() - begin) / 1_000_000
        assertEquals("$ms ms, the limit is $limitMs", true, ms < limitMs)
    }
}
