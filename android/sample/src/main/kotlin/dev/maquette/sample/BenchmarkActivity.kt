package dev.maquette.sample

import android.content.Intent
import android.os.Bundle
import android.widget.Button
import org.json.JSONObject

/** How fast this device is, and a report that can be saved. */
open class BenchmarkActivity : Screen() {
    private var report: JSONObject? = null
    private lateinit var save: Button

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Measures dense pose of rendered people for some seconds. Close other apps first.")
        button("Measure") { measure() }
        save = button("Save the report") {
            val file = Intent(Intent.ACTION_CREATE_DOCUMENT).addCategory(Intent.CATEGORY_OPENABLE)
            startActivityForResult(file.setType("application/json").putExtra(Intent.EXTRA_TITLE, "bench.json"), 1)
        }
        save.isEnabled = false
    }

    @Deprecated("the platform's way without androidx")
    override fun onActivityResult(request: Int, result: Int, data: Intent?) {
        val file = data?.data ?: return
        val text = report?.toString(1) ?: return
        val write = { contentResolver.openOutputStream(file)!!.use { it.write(text.toByteArray()) } }
        inBackground(write) { say("Saved.") }
    }

    protected open fun report(progress: (Double) -> Unit): JSONObject =
        Benchmark(maquette, networks("densepose-b-int8")).run(progress = progress)

    private fun measure() {
        say("Measuring …")
        val progress = { done: Double -> runOnUiThread { say("Measuring: %.0f %%".format(100 * done)) } }
        inBackground({ report(progress) }) { measured ->
            report = measured
            say(summaryOf(measured))
            save.isEnabled = true
        }
    }

    private fun summaryOf(report: JSONObject): String {
        val cases = report.getJSONArray("cases")
        return List(cases.length()) { cases.getJSONObject(it) }.joinToString("\n") { case ->
            val frame = case.getJSONObject("ms").getJSONObject("frame")
            "%s: %.1f pictures a second, %.1f ms (p99 %.1f)".format(
                case.getString("source"), case.getDouble("fps"), frame.getDouble("p50"), frame.getDouble("p99"),
            )
        }
    }
}
