plugins {
    id("com.android.application")
    kotlin("android")
}

android {
    namespace = "dev.maquette.sample"
    compileSdk = 35

    defaultConfig {
        minSdk = 26
        targetSdk = 35
        versionCode = 1
        versionName = "0.3.0"
    }
    // ArCaptureActivity, apart from what is compiled without ARCore; and the outfit that the desktop demo has.
    sourceSets["main"].kotlin.srcDir("src/arcore/kotlin")
    sourceSets["main"].assets.srcDir("../../desktop_demo/assets")
    androidResources { ignoreAssetsPatterns += listOf("!*.svg", "!*.desktop") }
    buildTypes { release { isMinifyEnabled = true } }
    compileOptions {
        sourceCompatibility = JavaVersion.VERSION_17
        targetCompatibility = JavaVersion.VERSION_17
    }
}

kotlin { jvmToolchain(17) }

dependencies {
    implementation(project(":maquette"))
    // Of this app alone: its licence is Google's, and the library knows nothing of it.
    implementation("com.google.ar:core:1.54.0")
}
