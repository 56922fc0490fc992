package dev.maquette

import dev.maquette.jni.*
import java.lang.ref.PhantomReference
import java.lang.ref.ReferenceQueue
import java.util.Collections
import java.util.concurrent.ConcurrentHashMap
import java.util.concurrent.atomic.AtomicBoolean
import java.util.concurrent.atomic.AtomicInteger
import kotlin.concurrent.thread

/**
 * A native object that belongs to one Kotlin object.
 *
 * It is released once: by [close], as soon as no call uses it any longer; or, if it is never closed, some time after
 * its owner is garbage. After [close] every use throws [IllegalStateException], and nothing reaches the native library.
 */
internal class Handle(owner: Any, private val pointer: Long, private val release: (Long) -> Unit) : AutoCloseable {
    private val what = owner.javaClass.simpleName
    private val isClosed = AtomicBoolean()

    /** Calls that use the object now, and one for as long as it is open. */
    private val uses = AtomicInteger(1)
    private val whenForgotten = Forgotten.watch(owner, this)

    /** Runs [work] with the native pointer, which stays valid meanwhile. */
    fun <T> use(work: (Long) -> T): T {
        while (true) {
            val count = uses.get()
            check(count > 0 && !isClosed.get()) { "This $what is closed." }
            if (uses.compareAndSet(count, count + 1)) break
        }
        try {
            return work(pointer)
        } finally {
            endUse()
        }
    }

    /** Returns [struct], filled by [get]. */
    fun <S : Memory> read(struct: S, get: (Long, Memory?) -> Unit): S = struct.apply { use { get(it, this) } }

    override fun close() {
        if (!isClosed.compareAndSet(false, true)) return
        Forgotten.leave(whenForgotten)
        endUse()
    }

    /** As [close], but first runs [work], which ends calls that wait; not when it is closed already. */
    fun closeAfter(work: (Long) -> Unit) {
        try {
            use(work)
        } catch (_: IllegalStateException) {
            return
        }
        close()
    }

    private fun endUse() {
        if (uses.decrementAndGet() == 0) release(pointer)
    }
}

/** A handle of this. The native object knows [kept] until it is destroyed, by the number that [create] gets. */
internal fun Any.handleThatKeeps(kept: Any, destroy: (Long) -> Unit, create: (id: Long) -> Long): Handle =
    Callbacks.keep(kept) { id ->
        Handle(this, create(id)) {
            destroy(it)
            Callbacks.release(id)
        }
    }

/** Closes handles whose owners are garbage. (java.lang.ref.Cleaner is not there before Android 13.) */
private object Forgotten {
    class Reference(owner: Any, queue: ReferenceQueue<Any>, val handle: Handle) : PhantomReference<Any>(owner, queue)

    private val queue = ReferenceQueue<Any>()

    /** References are found by the collector only while something holds them. */
    private val watched: MutableSet<Reference> = Collections.newSetFromMap(ConcurrentHashMap())

    init {
        thread(isDaemon = true, name = "maquette-forgotten") {
            while (true) (queue.remove() as Reference).handle.close()
        }
    }

    fun watch(owner: Any, handle: Handle) = Reference(owner, queue, handle).also(watched::add)

    fun leave(reference: Reference) {
        watched.remove(reference)
    }
}
